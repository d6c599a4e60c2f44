// The parts that the two kinds of world share.
#pragma once

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>

#include "scenes/worlds/physics_world.h"

namespace lazyccd::scenes {

inline btVector3 gravity_of(const WorldOptions& options) {
  return btVector3(0, static_cast<btScalar>(-options.gravity), 0);
}

/// The objects that every Bullet world needs.
struct WorldBase {
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
};

/// A world with LazyCCD's solver for it, if the options select LazyCCD.
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

  WorldBase base_;
  std::unique_ptr<Solver> lazy_;  // null without LazyCCD
};

std::unique_ptr<PhysicsWorld> make_rigid_world(const WorldOptions& options);
std::unique_ptr<PhysicsWorld> make_deformable_world(const WorldOptions& options);

}  // namespace lazyccd::scenes
