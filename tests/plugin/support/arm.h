// A multibody of boxes, for tests.
#pragma once

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "plugin/support/obstacle_worlds.h"

namespace lazyccd::test {

/// Boxes of 0.2 m, hinged in a row along x, that float freely or hang on a fixed base.
class Arm {
 public:
  Arm(ObstacleWorld& world, int links, bool fixed_base, const btVector3& at,
      const btVector3& axis = btVector3(0, 0, 1))
      : world_(static_cast<btMultiBodyDynamicsWorld&>(world.world())),
        body_(links, 1, inertia(), fixed_base, false) {
    body_.setBasePos(at);
    for (int i = 0; i < links; ++i) {
      body_.setupRevolute(i, 1, inertia(), i - 1, btQuaternion::getIdentity(), axis,
                          btVector3(btScalar(0.15), 0, 0), btVector3(btScalar(0.15), 0, 0), true);
    }
    body_.finalizeMultiDof();
    body_.setCanSleep(false);
    body_.setLinearDamping(0);
    body_.setAngularDamping(0);
    world_.addMultiBody(&body_);
    for (int i = -1; i < links; ++i) {
      auto collider = std::make_unique<btMultiBodyLinkCollider>(&body_, i);
      collider->setCollisionShape(&shape_);
      world_.addCollisionObject(collider.get());
      if (i < 0) {
        body_.setBaseCollider(collider.get());
      } else {
        body_.getLink(i).m_collider = collider.get();
      }
      colliders_.push_back(std::move(collider));
    }
    update_links();
  }
  ~Arm() {
    for (const auto& collider : colliders_) world_.removeCollisionObject(collider.get());
    world_.removeMultiBody(&body_);
  }

  btMultiBody& body() { return body_; }
  /// Sets the first joint, radians and rad/s, and all others to zero, as an application may between
  /// steps.
  void set_joints(double first, double speed = 0) {
    for (int i = 0; i < body_.getNumLinks(); ++i) {
      body_.setJointPos(i, static_cast<btScalar>(i == 0 ? first : 0));
      body_.setJointVel(i, static_cast<btScalar>(i == 0 ? speed : 0));
    }
    update_links();
  }
  const btCollisionObject& link(int i) const {
    return *colliders_[static_cast<std::size_t>(i + 1)];
  }
  /// Whether the point is inside of the box of a link, farther than `depth` metres.
  bool contains(const btVector3& x, double depth) const {
    const auto half = static_cast<btScalar>(0.1 - depth);
    const auto is_inside = [&](const auto& collider) {
      const btVector3 local = collider->getWorldTransform().invXform(x).absolute();
      return local.x() < half && local.y() < half && local.z() < half;
    };
    return std::any_of(colliders_.begin(), colliders_.end(), is_inside);
  }
  /// kg m/s
  btVector3 momentum() const {
    btVector3 sum(0, 0, 0);
    std::vector<btVector3> angular(colliders_.size()), linear(colliders_.size());
    body_.compTreeLinkVelocities(angular.data(), linear.data());
    for (int i = -1; i < body_.getNumLinks(); ++i)
      sum += body_.localDirToWorld(i, linear[static_cast<std::size_t>(i + 1)]);  // of 1 kg each
    return sum;
  }

 private:
  void update_links() {
    btAlignedObjectArray<btQuaternion> rotations;
    btAlignedObjectArray<btVector3> origins;
    body_.forwardKinematics(rotations, origins);
    body_.updateCollisionObjectWorldTransforms(rotations, origins);
  }
  static btVector3 inertia() { return btVector3(btScalar(0.01), btScalar(0.01), btScalar(0.01)); }

  btMultiBodyDynamicsWorld& world_;
  btMultiBody body_;
  btBoxShape shape_{btVector3(btScalar(0.1), btScalar(0.1), btScalar(0.1))};
  std::vector<std::unique_ptr<btMultiBodyLinkCollider>> colliders_;
};

}  // namespace lazyccd::test
