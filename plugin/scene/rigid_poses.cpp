#include "scene/rigid_poses.h"

#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "motion/rigid_displacement.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

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

// Returns the pose at the end of the step of a static or kinematic body that Bullet has at `now`:
// that pose, or one on the way to it if the body was held at the start of a step. Then it moves
// twice as far as Bullet's body, or by `min_fraction` of the remaining way if that is more.
btTransform catch_up(const RigidPose& pose, const btTransform& now) {
  constexpr btScalar min_fraction = btScalar(0.1);
  if (pose.start == pose.bullet_pose) return now;
  const btScalar remaining = max_point_displacement(*pose.object, pose.start, now),
                 bullet_displacement = max_point_displacement(*pose.object, pose.bullet_pose, now);
  if (!(remaining > 2 * bullet_displacement)) return now;
  const btScalar fraction = btMax(2 * bullet_displacement / remaining, min_fraction);
  return btTransform(pose.start.getRotation().slerp(now.getRotation(), fraction),
                     pose.start.getOrigin().lerp(now.getOrigin(), fraction));
}

}  // namespace

// Collects the rigid bodies of a broad phase.
class RigidPoses::Collector : public btBroadphaseAabbCallback {
 public:
  explicit Collector(Objects& objects) : objects_(objects) {}
  bool process(const btBroadphaseProxy* proxy) override {
    auto* object = static_cast<btCollisionObject*>(proxy->m_clientObject);
    if (is_rigid(*object)) objects_.emplace_back(object, proxy->m_uniqueId);
    return true;
  }

 private:
  Objects& objects_;
};

bool is_rigid(const btCollisionObject& object) {
  constexpr int rigid = btCollisionObject::CO_COLLISION_OBJECT | btCollisionObject::CO_RIGID_BODY |
                        btCollisionObject::CO_FEATHERSTONE_LINK;
  return (object.getInternalType() & rigid) != 0;
}

bool is_movable(const btCollisionObject& object) {
  if (const btMultiBodyLinkCollider* const link = btMultiBodyLinkCollider::upcast(&object))
    return is_moved(*link->m_multiBody, link->m_link);
  return btRigidBody::upcast(&object) && !object.isStaticOrKinematicObject();
}

void RigidPoses::begin_step(btBroadphaseInterface* broadphase) {
  find(broadphase);
  multibody_poses_.clear();
  for (RigidPose& pose : poses_) {
    if (pose.at_rest && !is_movable(*pose.object)) continue;  // starts where it ended
    const btMultiBodyLinkCollider* const link = btMultiBodyLinkCollider::upcast(pose.object);
    if (link && is_movable(*link) && multibody_poses_.count(link->m_multiBody) == 0)
      multibody_poses_.emplace(link->m_multiBody, pose_of(*link->m_multiBody));
    if (is_movable(*pose.object)) pose.bullet_pose = pose.object->getWorldTransform();
    pose.start = is_movable(*pose.object) ? pose.bullet_pose : pose.end;
  }
}

void RigidPoses::end_step(btBroadphaseInterface* broadphase, btScalar dt, WarningLog& warnings) {
  find(broadphase);
  for (RigidPose& pose : poses_) {
    const btTransform& now = pose.object->getWorldTransform();
    if (pose.at_rest && now == pose.end && teleported_.empty() && !is_movable(*pose.object) &&
        has_finite_velocity(*pose.object))
      continue;
    pose.jumped =
        teleported_.count(pose.object) > 0 ||
        is_jump(*pose.object, {pose.last_bullet_pose, pose.bullet_pose, now}, dt, jump_speed_);
    if (pose.jumped) pose.start = integrate(now, velocity_of(*pose.object), -dt);
    pose.end = pose.jumped || is_movable(*pose.object) ? now : catch_up(pose, now);
    pose.last_bullet_pose = pose.bullet_pose;
    pose.bullet_pose = now;
    pose.finite = is_finite(pose.end) && has_finite_velocity(*pose.object);
    pose.at_rest = pose.finite && !is_movable(*pose.object) && pose.start == now &&
                   pose.end == now && pose.last_bullet_pose == now && !pose.jumped;
    if (pose.finite && is_finite(pose.start)) continue;
    pose.start = pose.end;
    warnings.warn_once(
        "obstacle " + std::to_string(pose.unique_id),
        "rigid body " + std::to_string(pose.unique_id) +
            " (id of its broad phase proxy): its transform or velocity is not finite; collision "
            "detection leaves it out");
  }
  teleported_.clear();
}

void RigidPoses::hold_at_start(const btCollisionObject& object) {
  for (RigidPose& pose : poses_) {
    if (pose.object != &object) continue;
    pose.end = pose.start;
    pose.at_rest = false;
  }
}

void RigidPoses::find(btBroadphaseInterface* broadphase) {
  objects_.clear();
  Collector collector(objects_);
  const btScalar far = BT_LARGE_FLOAT;
  if (broadphase)
    broadphase->aabbTest(btVector3(-far, -far, -far), btVector3(far, far, far), collector);
  if (objects_ == last_objects_) return;
  if (!are_known(objects_)) update_objects(objects_);
  last_objects_ = objects_;
}

bool RigidPoses::are_known(const Objects& objects) const {
  return objects.size() == known_.size() &&
         std::all_of(objects.begin(), objects.end(), [this](const Object& object) {
           const auto known = known_.find(object.second);
           return known != known_.end() && known->second == object.first;
         });
}

void RigidPoses::update_objects(const Objects& objects) {
  std::vector<RigidPose> poses;
  poses.reserve(objects.size());
  for (const auto& [object, id] : objects) {
    const btTransform& now = object->getWorldTransform();
    poses.push_back({object, id, now, now, now, now});
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
    // A static or kinematic body is swept from its pose at the end of the last step.
    pose = *old;
  }
  poses_ = std::move(poses);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
