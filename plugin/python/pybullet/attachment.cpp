#include "attachment.h"

#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorld.h>
#include <BulletSoftBody/btDefaultSoftBodySolver.h>

#include <cstring>
#include <typeinfo>

#include "private_members.h"

namespace lazyccd::pybullet {

using namespace bullet;

namespace {

// PyBullet's module has a copy of Bullet of its own, so the types are compared by name.
template <class Type, class Object>
bool is_exactly(const Object& object) {
  return std::strcmp(typeid(object).name(), typeid(Type).name()) == 0;
}

constexpr int kStockPasses = 5;

}  // namespace

void Attachment::DeleteSolver::operator()(btSoftBodySolver* solver) const {
  solver->~btSoftBodySolver();
  btAlignedFree(solver);
}

Attachment::Attachment(btDiscreteDynamicsWorld& world, const SolverOptions& options)
    : world_(&world) {
  attach(options);
}

void Attachment::attach(const SolverOptions& options) {
  switch (world_->getWorldType()) {
    case BT_DEFORMABLE_MULTIBODY_DYNAMICS_WORLD:
      attach_deformable(options);
      break;
    case BT_SOFT_MULTIBODY_DYNAMICS_WORLD:
      attach_soft(options);
      break;
    default:
      note_ = "this world has no soft bodies";
  }
}

void Attachment::refuse(const std::string& why) {
  layout_is_known_ = false;
  note_ = "this PyBullet is not laid out as version 3.2.7: " + why;
}

btAlignedObjectArray<btSoftBody*>& Attachment::soft_bodies() const {
  if (world_->getWorldType() == BT_SOFT_MULTIBODY_DYNAMICS_WORLD)
    return static_cast<btSoftMultiBodyDynamicsWorld*>(world_)->getSoftBodyArray();
  return static_cast<btDeformableMultiBodyDynamicsWorld*>(world_)->getSoftBodyArray();
}

void Attachment::tell_bodies(btSoftBodySolver* solver) {
  btAlignedObjectArray<btSoftBody*>& bodies = soft_bodies();
  for (int i = 0; i < bodies.size(); ++i) bodies[i]->setSoftBodySolver(solver);
}

void Attachment::attach_deformable(const SolverOptions& options) {
  auto& world = static_cast<btDeformableMultiBodyDynamicsWorld&>(*world_);
  if (!is_exactly<btDeformableMultiBodyDynamicsWorld>(world)) return refuse("the world's type");
  auto& constraints =
      static_cast<btDeformableMultiBodyConstraintSolver&>(*world.getConstraintSolver());
  if (!is_exactly<btDeformableMultiBodyConstraintSolver>(constraints))
    return refuse("the constraint solver's type");
  btDeformableBodySolver* const stock = world.*member_of(DeformableWorldSolver());
  if (stock == nullptr || constraints.*member_of(ConstraintsSolver()) != stock)
    return refuse("the deformable solver");
  if (world.*member_of(DeformableWorldPasses()) != kStockPasses)
    return refuse("the passes of continuous detection");
  if (!is_exactly<btDeformableBodySolver>(*stock)) {
    note_ = "this world has reduced deformable bodies, which LazyCCD leaves alone";
    return;
  }
  deformable_ = std::make_unique<btLazyDeformableBodySolver>(options);
  deformable_->use_motors_of(&world);
  deformable_->getLagrangianForceArray()->copyFromArray(*stock->getLagrangianForceArray());
  world.*member_of(DeformableWorldSolver()) = deformable_.get();
  constraints.setDeformableSolver(deformable_.get());
  stock_deformable_ = stock;
  stock_passes_ = world.*member_of(DeformableWorldPasses());
  world.*member_of(DeformableWorldPasses()) = 0;  // nothing reads the contacts that they find
  tell_bodies(deformable_.get());
  note_ = "on, in a deformable world";
}

void Attachment::attach_soft(const SolverOptions& options) {
  auto& world = static_cast<btSoftMultiBodyDynamicsWorld&>(*world_);
  if (!is_exactly<btSoftMultiBodyDynamicsWorld>(world)) return refuse("the world's type");
  btSoftBodySolver* const stock = world.*member_of(SoftWorldSolver());
  if (stock == nullptr || !(world.*member_of(SoftWorldOwnsSolver())) ||
      !is_exactly<btDefaultSoftBodySolver>(*stock))
    return refuse("the soft body solver");
  soft_ = std::make_unique<btLazySoftBodySolver>(options);
  soft_->use_motors_of(&world);
  stock_soft_.reset(stock);
  world.*member_of(SoftWorldSolver()) = soft_.get();
  world.*member_of(SoftWorldOwnsSolver()) = false;
  tell_bodies(soft_.get());
  note_ = "on, in a soft world";
}

void Attachment::detach() {
  if (is_attached()) build_trees();
  give_solver_back();
  note_ = "off";
}

void Attachment::restart(const SolverOptions& options) {
  give_solver_back();
  attach(options);
}

void Attachment::build_trees() {
  btAlignedObjectArray<btSoftBody*>& bodies = soft_bodies();
  for (int i = 0; i < bodies.size(); ++i)
    deformable_ ? btLazyDeformableBodySolver::build_trees(*bodies[i])
                : btLazySoftBodySolver::build_trees(*bodies[i]);
}

void Attachment::give_solver_back() {
  if (deformable_) {
    auto& world = static_cast<btDeformableMultiBodyDynamicsWorld&>(*world_);
    auto& constraints =
        static_cast<btDeformableMultiBodyConstraintSolver&>(*world.getConstraintSolver());
    stock_deformable_->getLagrangianForceArray()->copyFromArray(
        *deformable_->getLagrangianForceArray());
    // It numbers the nodes anew only if their count changes. LazyCCD has other numbers if bodies
    // slept.
    stock_deformable_->reinitialize(btAlignedObjectArray<btSoftBody*>(), btScalar(-1));
    world.*member_of(DeformableWorldSolver()) = stock_deformable_;
    world.*member_of(DeformableWorldPasses()) = stock_passes_;
    constraints.setDeformableSolver(stock_deformable_);
    tell_bodies(stock_deformable_);
    deformable_.reset();
  } else if (soft_) {
    auto& world = static_cast<btSoftMultiBodyDynamicsWorld&>(*world_);
    tell_bodies(stock_soft_.get());
    world.*member_of(SoftWorldOwnsSolver()) = true;
    world.*member_of(SoftWorldSolver()) = stock_soft_.release();
    soft_.reset();
  }
}

std::string Attachment::status() const {
  if (deformable_) return note_ + "\n" + deformable_->status();
  if (soft_) return note_ + "\n" + soft_->status();
  return note_;
}

std::vector<bullet::ExcludedBody> Attachment::excluded_bodies() const {
  if (deformable_) return deformable_->excluded_bodies();
  if (soft_) return soft_->excluded_bodies();
  return {};
}

StepStats Attachment::step_stats() const {
  return deformable_ ? deformable_->step_stats() : soft_ ? soft_->step_stats() : StepStats();
}

StepStats Attachment::total_stats() const {
  return deformable_ ? deformable_->total_stats() : soft_ ? soft_->total_stats() : StepStats();
}

Span<const StepContact> Attachment::contacts() const {
  if (deformable_) return deformable_->contacts();
  if (soft_) return soft_->contacts();
  return {};
}

}  // namespace lazyccd::pybullet
