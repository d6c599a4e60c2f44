#include "random/random_world.h"

#include <BulletCollision/BroadphaseCollision/btAxisSweep3.h>
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/BroadphaseCollision/btSimpleBroadphase.h>
#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <BulletSoftBody/btSoftMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>

#include "lazyccd/bullet/deformable_world.h"

namespace lazyccd::test {
namespace {

std::unique_ptr<btBroadphaseInterface> random_broadphase(RandomSource& random) {
  const btVector3 far(20000, 20000, 20000);
  if (random.chance(0.05)) return std::make_unique<btSimpleBroadphase>();
  if (random.chance(0.1)) return std::make_unique<bt32BitAxisSweep3>(-far, far, 1000);
  return std::make_unique<btDbvtBroadphase>();
}

}  // namespace

RandomWorld::RandomWorld(scenes::World kind, scenes::Collisions collisions,
                         const bullet::SolverOptions& options, RandomSource& random)
    : kind_(kind),
      broadphase_(random_broadphase(random)),
      soft_solver_(options),
      deformable_solver_(options) {
  btGImpactCollisionAlgorithm::registerAlgorithm(&dispatcher_);
  const bool layered = random.chance(0.1);
  for (int a = 0; a < layers; ++a) {
    for (int b = a; b < layers; ++b) meets_[a][b] = meets_[b][a] = !layered || random.chance(0.6);
  }
  const bool is_lazy = collisions == scenes::Collisions::lazyccd;
  const bool other = random.chance(0.15);
  if (is_rigid()) {
    btSoftBodySolver* solver = is_lazy ? &soft_solver_ : nullptr;
    if (other) {
      name_ = "R multi";
      auto world = std::make_unique<btSoftMultiBodyDynamicsWorld>(
          &dispatcher_, broadphase_.get(), &multi_body_solver_, &configuration_, solver);
      info_ = &world->getWorldInfo();
      world_ = std::move(world);
    } else {
      name_ = "R";
      auto world = std::make_unique<btSoftRigidDynamicsWorld>(&dispatcher_, broadphase_.get(),
                                                              &solver_, &configuration_, solver);
      info_ = &world->getWorldInfo();
      world_ = std::move(world);
    }
  } else {
    btDeformableBodySolver* solver = is_lazy ? &deformable_solver_ : &bullets_solver_;
    constraints_.setDeformableSolver(solver);
    std::unique_ptr<btDeformableMultiBodyDynamicsWorld> world;
    if (other || !is_lazy) {
      name_ = "D stock";
      world = std::make_unique<btDeformableMultiBodyDynamicsWorld>(
          &dispatcher_, broadphase_.get(), &constraints_, &configuration_, solver);
    } else {
      name_ = "D";
      world = std::make_unique<bullet::btLazyDeformableMultiBodyDynamicsWorld>(
          &dispatcher_, broadphase_.get(), &constraints_, &configuration_, &deformable_solver_);
    }
    // setImplicit(true) is not tested: if a node is pinned, Bullet then writes past the end of its
    // arrays, because btDeformableBodySolver allocates no space for the multipliers.
    info_ = &world->getWorldInfo();
    world_ = std::move(world);
  }
  if (layered) name_ += " layers";
}

void RandomWorld::set_gravity(const btVector3& gravity) {
  gravity_ = gravity;
  world_->setGravity(gravity);
  info_->m_gravity = gravity;
}

int RandomWorld::mask_of(int layer) const {
  int mask = btBroadphaseProxy::AllFilter & ~(((1 << layers) - 1) << 8);
  for (int other = 0; other < layers; ++other) mask |= meets_[layer][other] << (8 + other);
  return mask;
}

void RandomWorld::add(btSoftBody& body, int layer) {
  const int group = 1 << (8 + layer), mask = mask_of(layer);
  if (auto* rigid = dynamic_cast<btSoftRigidDynamicsWorld*>(world_.get())) {
    rigid->addSoftBody(&body, group, mask);
  } else if (auto* multi = dynamic_cast<btSoftMultiBodyDynamicsWorld*>(world_.get())) {
    multi->addSoftBody(&body, group, mask);
  } else {
    static_cast<btDeformableMultiBodyDynamicsWorld&>(*world_).addSoftBody(&body, group, mask);
  }
}

void RandomWorld::remove(btSoftBody& body) {
  if (auto* rigid = dynamic_cast<btSoftRigidDynamicsWorld*>(world_.get())) {
    rigid->removeSoftBody(&body);
  } else if (auto* multi = dynamic_cast<btSoftMultiBodyDynamicsWorld*>(world_.get())) {
    multi->removeSoftBody(&body);
  } else {
    static_cast<btDeformableMultiBodyDynamicsWorld&>(*world_).removeSoftBody(&body);
  }
}

void RandomWorld::add(btRigidBody& body, int layer) {
  world_->addRigidBody(&body, 1 << (8 + layer), mask_of(layer));
}

void RandomWorld::add_force(btSoftBody& body, std::unique_ptr<btDeformableLagrangianForce> force) {
  static_cast<btDeformableMultiBodyDynamicsWorld&>(*world_).addForce(&body, force.get());
  forces_.push_back(std::move(force));
}

void RandomWorld::teleported(const btRigidBody& body) {
  if (is_rigid())
    soft_solver_.teleported(body);
  else
    deformable_solver_.teleported(body);
}

const bullet::StepStats& RandomWorld::step_stats() const {
  return is_rigid() ? soft_solver_.step_stats() : deformable_solver_.step_stats();
}
const bullet::StepStats& RandomWorld::total_stats() const {
  return is_rigid() ? soft_solver_.total_stats() : deformable_solver_.total_stats();
}
bool RandomWorld::has_left_out() const {
  return !(is_rigid() ? soft_solver_.excluded_bodies() : deformable_solver_.excluded_bodies())
              .empty();
}

std::string RandomWorld::status() const {
  return is_rigid() ? soft_solver_.status() : deformable_solver_.status();
}

}  // namespace lazyccd::test
