#include "scenes/physics_world.h"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <BulletSoftBody/btDeformableBodySolver.h>
#include <BulletSoftBody/btDeformableGravityForce.h>
#include <BulletSoftBody/btDeformableMassSpringForce.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>

#include <algorithm>

#include "lazyccd/bullet/deformable_body_solver.h"
#include "lazyccd/bullet/deformable_world.h"
#include "lazyccd/bullet/soft_body_solver.h"

namespace lazyccd::scenes {
namespace {

btVector3 gravity_of(const WorldOptions& options) {
  return btVector3(0, static_cast<btScalar>(-options.gravity), 0);
}

// What both worlds stand on, and the bodies that never move.
struct Ground {
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  std::vector<std::unique_ptr<btCollisionShape>> shapes;
  std::vector<std::unique_ptr<btRigidBody>> rigid_bodies;

  void add_static(btDiscreteDynamicsWorld& world, std::unique_ptr<btCollisionShape> shape,
                  const btTransform& pose, double margin) {
    shape->setMargin(static_cast<btScalar>(margin));
    btRigidBody::btRigidBodyConstructionInfo info(0, nullptr, shape.get());
    info.m_startWorldTransform = pose;
    rigid_bodies.push_back(std::make_unique<btRigidBody>(info));
    rigid_bodies.back()->setFriction(btScalar(0.5));
    shapes.push_back(std::move(shape));
    world.addRigidBody(rigid_bodies.back().get());
  }
};

// The part that both worlds share; Solver is LazyCCD's for that world.
template <class Solver>
class WorldWith : public PhysicsWorld {
 public:
  const bullet::StepStats* step_stats() const override {
    return lazy_ ? &lazy_->step_stats() : nullptr;
  }
  const bullet::StepStats* total_stats() const override {
    return lazy_ ? &lazy_->total_stats() : nullptr;
  }
  Span<const bullet::StepContact> contacts() const override {
    return lazy_ ? lazy_->contacts() : Span<const bullet::StepContact>();
  }
  std::string status() const override { return lazy_ ? lazy_->status() : ""; }

 protected:
  explicit WorldWith(const WorldOptions& options) : PhysicsWorld(options) {
    if (options.collisions == Collisions::lazyccd)
      lazy_ = std::make_unique<Solver>(options.lazyccd);
  }

  Ground ground_;
  std::unique_ptr<Solver> lazy_;  // null with Bullet's own solver
};

class RigidWorld : public WorldWith<bullet::btLazySoftBodySolver> {
 public:
  explicit RigidWorld(const WorldOptions& options) : WorldWith(options) {
    world_ = std::make_unique<btSoftRigidDynamicsWorld>(&ground_.dispatcher, &ground_.broadphase,
                                                        &constraints_, &ground_.configuration,
                                                        lazy_.get());
    world_->setGravity(gravity_of(options));
    info().m_gravity = gravity_of(options);
    info().air_density = 0;
  }
  ~RigidWorld() override {
    for (const auto& body : bodies()) world_->removeSoftBody(body.get());
    for (const auto& body : ground_.rigid_bodies) world_->removeRigidBody(body.get());
  }

  btSoftBodyWorldInfo& info() override { return world_->getWorldInfo(); }
  void add_static(std::unique_ptr<btCollisionShape> shape, const btTransform& pose) override {
    ground_.add_static(*world_, std::move(shape), pose, options().margin);
  }
  void step() override {
    const btScalar dt = static_cast<btScalar>(options().dt);
    world_->stepSimulation(dt, 0, dt);
  }

 private:
  void enter(btSoftBody* body, int group, int mask) override {
    body->m_materials[0]->m_kLST = btScalar(0.9);
    body->m_cfg.piterations = 10;
    body->m_cfg.kDP = btScalar(0.005);
    body->m_cfg.collisions = btSoftBody::fCollision::SDF_RS | btSoftBody::fCollision::VF_SS;
    world_->addSoftBody(body, group, mask);
  }
  void leave(btSoftBody* body) override { world_->removeSoftBody(body); }

  btSequentialImpulseConstraintSolver constraints_;
  std::unique_ptr<btSoftRigidDynamicsWorld> world_;
};

class DeformableWorld : public WorldWith<bullet::btLazyDeformableBodySolver> {
 public:
  explicit DeformableWorld(const WorldOptions& options)
      // Explicit springs: stiff ones need short steps.
      : WorldWith(options),
        springs_(stiffness(options), stiffness(options) / 10),
        weight_(gravity_of(options)) {
    if (lazy_ && !options.stock_world) {
      constraints_.setDeformableSolver(lazy_.get());
      world_ = std::make_unique<bullet::btLazyDeformableMultiBodyDynamicsWorld>(
          &ground_.dispatcher, &ground_.broadphase, &constraints_, &ground_.configuration,
          lazy_.get());
    } else {
      btDeformableBodySolver* solver = lazy_ ? lazy_.get() : &bullets_;
      constraints_.setDeformableSolver(solver);
      world_ = std::make_unique<btDeformableMultiBodyDynamicsWorld>(
          &ground_.dispatcher, &ground_.broadphase, &constraints_, &ground_.configuration, solver);
    }
    world_->setGravity(gravity_of(options));
    info().m_gravity = gravity_of(options);
    info().air_density = 0;
  }
  ~DeformableWorld() override {
    for (const auto& body : bodies()) world_->removeSoftBody(body.get());
    for (const auto& body : ground_.rigid_bodies) world_->removeRigidBody(body.get());
  }

  btSoftBodyWorldInfo& info() override { return world_->getWorldInfo(); }
  void add_static(std::unique_ptr<btCollisionShape> shape, const btTransform& pose) override {
    ground_.add_static(*world_, std::move(shape), pose, options().margin);
  }
  void step() override {
    const btScalar dt = static_cast<btScalar>(options().dt);
    world_->stepSimulation(dt, 0, dt);
  }

 private:
  static btScalar stiffness(const WorldOptions& options) {
    return options.dt > 1.0 / 120 ? btScalar(0.5) : btScalar(2);
  }
  void enter(btSoftBody* body, int group, int mask) override {
    using Flag = btSoftBody::fCollision;
    body->m_cfg.collisions = Flag::SDF_RD | Flag::SDF_RDN | Flag::SDF_RDF | Flag::VF_DD;
    body->m_cfg.kKHR = 1;
    body->m_cfg.kCHR = 1;
    body->m_sleepingThreshold = 0;
    world_->addSoftBody(body, group, mask);
    world_->addForce(body, &springs_);
    if (options().gravity != 0) world_->addForce(body, &weight_);
  }
  void leave(btSoftBody* body) override { world_->removeSoftBody(body); }

  btDeformableMultiBodyConstraintSolver constraints_;
  btDeformableMassSpringForce springs_;
  btDeformableGravityForce weight_;
  btDeformableBodySolver bullets_;
  std::unique_ptr<btDeformableMultiBodyDynamicsWorld> world_;
};

}  // namespace

std::unique_ptr<PhysicsWorld> PhysicsWorld::make(const WorldOptions& options) {
  if (options.world == World::rigid) return std::make_unique<RigidWorld>(options);
  return std::make_unique<DeformableWorld>(options);
}

void PhysicsWorld::add(std::unique_ptr<btSoftBody> body, int group, int mask) {
  body->getCollisionShape()->setMargin(static_cast<btScalar>(options_.margin));
  body->setActivationState(DISABLE_DEACTIVATION);
  bodies_.push_back(std::move(body));
  enter(bodies_.back().get(), group, mask);
}

std::unique_ptr<btSoftBody> PhysicsWorld::remove(btSoftBody* body) {
  leave(body);
  const auto at = std::find_if(bodies_.begin(), bodies_.end(),
                               [body](const auto& owned) { return owned.get() == body; });
  std::unique_ptr<btSoftBody> result = std::move(*at);
  bodies_.erase(at);
  return result;
}

}  // namespace lazyccd::scenes
