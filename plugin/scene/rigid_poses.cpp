#include "scene/rigid_poses.h"

#include <BulletCollision/CollisionShapes/btCollisionShape.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

class Collector : public btBroadphaseAabbCallback {
 public:
  bool process(const btBroadphaseProxy* proxy) override {
    auto* object = static_cast<btCollisionObject*>(proxy->m_clientObject);
    if (is_rigid(*object)) objects.push_back(object);
    return true;
  }
  std::vector<btCollisionObject*> objects;
};

bool is_finite(const btTransform& pose) {
  for (int i = 0; i < 3; ++i) {
    if (!std::isfinite(pose.getOrigin()[i])) return false;
    for (int k = 0; k < 3; ++k) {
      if (!std::isfinite(pose.getBasis()[i][k])) return false;
    }
  }
  return true;
}

bool has_finite_velocity(const btCollisionObject& object) {
  const btRigidBody* body = btRigidBody::upcast(&object);
  return !body || (std::isfinite(body->getLinearVelocity().length2()) &&
                   std::isfinite(body->getAngularVelocity().length2()));
}

// Metres that a point of the body moves at most, about.
btScalar way(const RigidPose& pose, const btTransform& from, const btTransform& to) {
  btVector3 centre;
  btScalar radius;
  pose.object->getCollisionShape()->getBoundingSphere(centre, radius);
  const btMatrix3x3 turned = to.getBasis() - from.getBasis();
  const btScalar rotation = turned[0].length() + turned[1].length() + turned[2].length();
  return from.getOrigin().distance(to.getOrigin()) + rotation * (centre.length() + radius);
}

// Where a body is at the end of the step that Bullet has at `now`: there, or on the way to it where
// it was left behind.
btTransform follow(const RigidPose& pose, const btTransform& now) {
  constexpr btScalar least_part = btScalar(0.1);
  if (pose.start == pose.seen) return now;
  const btScalar left = way(pose, pose.start, now), moved = way(pose, pose.seen, now);
  if (!(left > 2 * moved)) return now;
  const btScalar part = btMax(2 * moved / left, least_part);
  return btTransform(pose.start.getRotation().slerp(now.getRotation(), part),
                     pose.start.getOrigin().lerp(now.getOrigin(), part));
}

}  // namespace

bool is_rigid(const btCollisionObject& object) {
  constexpr int rigid = btCollisionObject::CO_COLLISION_OBJECT | btCollisionObject::CO_RIGID_BODY |
                        btCollisionObject::CO_FEATHERSTONE_LINK;
  return (object.getInternalType() & rigid) != 0;
}

bool is_dynamic(const btCollisionObject& object) {
  return btRigidBody::upcast(&object) && !object.isStaticOrKinematicObject();
}

void RigidPoses::begin_step(btBroadphaseInterface* broadphase) {
  find(broadphase);
  for (RigidPose& pose : poses_)
    pose.start = is_dynamic(*pose.object) ? pose.object->getWorldTransform() : pose.end;
}

void RigidPoses::end_step(btBroadphaseInterface* broadphase, WarningLog& warnings) {
  find(broadphase);
  for (RigidPose& pose : poses_) {
    const btTransform& now = pose.object->getWorldTransform();
    pose.end = is_dynamic(*pose.object) ? now : follow(pose, now);
    pose.seen = now;
    pose.finite = is_finite(pose.end) && has_finite_velocity(*pose.object);
    if (pose.finite && is_finite(pose.start)) continue;
    pose.start = pose.end;
    warnings.warn_once(
        "obstacle " + std::to_string(pose.unique_id),
        "rigid body " + std::to_string(pose.unique_id) +
            " (by broad phase proxy): its transform or velocity is not finite; it is left out");
  }
}

void RigidPoses::leave_behind(const btCollisionObject& object) {
  for (RigidPose& pose : poses_) {
    if (pose.object == &object) pose.end = pose.start;
  }
}

void RigidPoses::find(btBroadphaseInterface* broadphase) {
  Collector collector;
  collector.objects.reserve(poses_.size());
  const btScalar far = BT_LARGE_FLOAT;
  if (broadphase)
    broadphase->aabbTest(btVector3(-far, -far, -far), btVector3(far, far, far), collector);
  if (!are_known(collector.objects)) take(collector.objects);
}

bool RigidPoses::are_known(const Objects& objects) const {
  return objects.size() == known_.size() &&
         std::all_of(objects.begin(), objects.end(), [this](const btCollisionObject* object) {
           const auto known = known_.find(object->getBroadphaseHandle()->m_uniqueId);
           return known != known_.end() && known->second == object;
         });
}

void RigidPoses::take(const Objects& objects) {
  std::vector<RigidPose> poses;
  poses.reserve(objects.size());
  for (btCollisionObject* object : objects) {
    const btTransform& now = object->getWorldTransform();
    poses.push_back({object, object->getBroadphaseHandle()->m_uniqueId, now, now, now, true});
  }
  const auto before = [](const RigidPose& a, const RigidPose& b) {
    return a.unique_id < b.unique_id;
  };
  std::sort(poses.begin(), poses.end(), before);
  auto old = poses_.begin();
  known_.clear();
  for (RigidPose& pose : poses) {
    known_.insert({pose.unique_id, pose.object});
    while (old != poses_.end() && before(*old, pose)) ++old;
    if (old == poses_.end() || before(pose, *old) || old->object != pose.object) continue;
    // What is driven is swept from where the last step left it.
    pose = *old;
  }
  poses_ = std::move(poses);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
