#include "scene/rigid_poses.h"

#include <BulletCollision/CollisionShapes/btCollisionShape.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "motion/rigid_displacement.h"
#include "settings.h"

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

// Returns the pose at the end of the step of a static or kinematic body that its motion leads to
// `now`: that pose, or one on the way to it if the body was held at the start of a step. Then it
// moves farther than its motion, or by a fraction of the remaining way if that is more.
btTransform catch_up(const RigidPose& pose, const btTransform& now) {
  if (pose.start == pose.spread_pose) return now;
  const btScalar remaining = max_point_displacement(*pose.object, pose.start, now),
                 displacement = max_point_displacement(*pose.object, pose.spread_pose, now);
  if (!(remaining > settings::displacement::catch_up_factor * displacement)) return now;
  const btScalar fraction =
      btMax(settings::displacement::catch_up_factor * displacement / remaining,
            btScalar(settings::displacement::min_catch_up_fraction));
  return part_way(pose.start, now, fraction);
}

// Whether the body was at rest, no impulse moves it, and it is still where it was.
bool rests(const RigidPose& pose) {
  return pose.at_rest && pose.object->isStaticOrKinematicObject() &&
         pose.object->getWorldTransform() == pose.end &&
         pose.object->getInternalType() != btCollisionObject::CO_FEATHERSTONE_LINK;
}

// An application that writes back the poses that it has read may round them on the way.
bool differs_by_rounding(const btTransform& a, const btTransform& b) {
  constexpr btScalar rounding = 16 * SIMD_EPSILON;
  const auto is_near = [](const btVector3& x, const btVector3& y, btScalar size) {
    return (x - y).length2() <= rounding * rounding * size * size;
  };
  return is_near(a.getOrigin(), b.getOrigin(), b.getOrigin().length()) &&
         is_near(a.getBasis()[0], b.getBasis()[0], 1) &&
         is_near(a.getBasis()[1], b.getBasis()[1], 1) &&
         is_near(a.getBasis()[2], b.getBasis()[2], 1);
}

}  // namespace

AxisBox bounds(const RigidPose& pose) {
  if (pose.at_rest) {
    const btBroadphaseProxy& proxy = *pose.object->getBroadphaseHandle();
    return {proxy.m_aabbMin, proxy.m_aabbMax};
  }
  const btCollisionShape& shape = *pose.object->getCollisionShape();
  AxisBox box;
  shape.getAabb(pose.end, box.lower, box.upper);
  if (pose.start == pose.end) return box;
  AxisBox at_start;
  shape.getAabb(pose.start, at_start.lower, at_start.upper);
  box.add(at_start);
  return box;
}

bool is_rigid(const btCollisionObject& object) {
  constexpr int rigid = btCollisionObject::CO_COLLISION_OBJECT | btCollisionObject::CO_RIGID_BODY |
                        btCollisionObject::CO_FEATHERSTONE_LINK;
  return (object.getInternalType() & rigid) != 0;
}

bool is_movable(const btCollisionObject& object) {
  if (const btMultiBodyLinkCollider* const link = btMultiBodyLinkCollider::upcast(&object))
    return is_moved(*link->m_multiBody, link->m_link);
  return btRigidBody::upcast(&object) && !object.isStaticOrKinematicObject() &&
         object.getActivationState() != DISABLE_SIMULATION;
}

void RigidPoses::begin_step(btBroadphaseInterface* broadphase) {
  added_.clear();
  find(broadphase);
  std::unordered_map<const btMultiBody*, MultibodyPoses> last_multibodies;
  last_multibodies.swap(multibodies_);
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    RigidPose& pose = poses_[i];
    // A body at rest starts where it ended, unless it has become dynamic.
    if (!is_followed_[i] && !is_movable(*pose.object)) continue;
    pose.start = pose.end;
    pose.driven = false;
    if (!is_movable(*pose.object)) continue;
    pose.begin_pose = pose.object->getWorldTransform();
    // A body that becomes dynamic in the middle of a frame starts where it was.
    const bool lags = pose.lags();
    const bool goes_on = pose.finite && !lags;
    pose.driven = goes_on && !differs_by_rounding(pose.begin_pose, pose.end);
    pose.spread_pose = pose.bullet_pose = goes_on ? pose.end : pose.begin_pose;
    if (!lags) pose.start = pose.spread_pose;
    const btMultiBodyLinkCollider* const link = btMultiBodyLinkCollider::upcast(pose.object);
    if (!link) continue;
    const auto [entry, is_new] = multibodies_.try_emplace(link->m_multiBody);
    MultibodyPoses& multibody = entry->second;
    multibody.any_driven = multibody.any_driven || pose.driven;
    if (!is_new) continue;
    multibody.begin = pose_of(*link->m_multiBody);
    const auto last = last_multibodies.find(link->m_multiBody);
    if (last != last_multibodies.end()) multibody.last_end = std::move(last->second.end);
  }
}

void RigidPoses::end_step(btBroadphaseInterface* broadphase, btScalar dt, WarningLog& warnings) {
  find(broadphase);
  dt_ = dt;
  for (std::size_t i = 0; i < poses_.size(); ++i)
    is_followed_[i] = !teleported_.empty() || !rests(poses_[i]);
  for (std::size_t i = 0; i < poses_.size(); ++i)
    if (is_followed_[i]) set_end(poses_[i], warnings);
  jump_with_multibodies();
  read_multibody_ends();
  teleported_.clear();
  list_followed();
}

// Looks at each body, because Bullet's tree loses bodies once the bounds of one were not finite.
void RigidPoses::follow(Span<const AxisBox> boxes, WarningLog& warnings) {
  bool found_any = false;
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    if (is_followed_[i] || !overlaps_any(boxes, bounds(poses_[i]))) continue;
    is_followed_[i] = found_any = true;
    set_end(poses_[i], warnings);
  }
  if (found_any) list_followed();
}

void RigidPoses::set_end(RigidPose& pose, WarningLog& warnings) {
  const btTransform& now = pose.object->getWorldTransform();
  const bool is_teleported = !teleported_.empty() && teleported_.count(pose.object) > 0;
  if (pose.at_rest && now == pose.end && !is_teleported && !is_movable(*pose.object) &&
      has_finite_velocity(*pose.object))
    return;
  const bool is_on_its_way = pose.lags() && now == pose.bullet_pose;
  const RigidDisplacement displacement{pose.last_spread_pose, pose.spread_pose, now, pose.driven};
  pose.jumped =
      is_teleported || (!is_on_its_way && is_jump(*pose.object, displacement, dt_, jump_speed_));
  if (pose.jumped) jump(pose);
  const btTransform spread = pose.jumped ? now : spread_pose(pose);
  pose.end = pose.jumped || is_movable(*pose.object) ? now : catch_up(pose, spread);
  pose.last_spread_pose = pose.spread_pose;
  pose.spread_pose = spread;
  pose.bullet_pose = now;
  pose.finite = is_finite(pose.end) && has_finite_velocity(*pose.object);
  pose.at_rest = pose.finite && !is_movable(*pose.object) && pose.start == now && pose.end == now &&
                 pose.last_spread_pose == now && !pose.jumped;
  if (pose.finite && is_finite(pose.start)) return;
  pose.start = pose.end;
  warnings.warn_once(
      "obstacle " + std::to_string(pose.unique_id),
      "rigid body " + std::to_string(pose.unique_id) +
          " (id of its broad phase proxy): its transform or velocity is not finite; collision "
          "detection leaves it out");
}

void RigidPoses::jump(RigidPose& pose) const {
  pose.start = pose.driven
                   ? pose.begin_pose
                   : integrate(pose.object->getWorldTransform(), velocity_of(*pose.object), -dt_);
  pose.jumped = true;
  pose.driven = false;
}

btTransform RigidPoses::spread_pose(const RigidPose& pose) const {
  const btTransform& now = pose.object->getWorldTransform();
  // A body that is behind when its next frame begins catches up, so that no lag stays.
  const bool is_behind = pose.lags() && !(now == pose.bullet_pose);
  if (is_behind || std::binary_search(carriers_.begin(), carriers_.end(), pose.object)) return now;
  return spread_over_substeps(*pose.object, pose.spread_pose, now, dt_);
}

const MultibodyPose* RigidPoses::start_of(const btMultiBody& body) const {
  const auto found = multibodies_.find(&body);
  if (found == multibodies_.end()) return nullptr;
  const MultibodyPoses& poses = found->second;
  const bool starts_at_end = poses.any_driven && !poses.jumped && poses.last_end &&
                             poses.last_end->joints.size() == poses.begin.joints.size();
  return starts_at_end ? &*poses.last_end : &poses.begin;
}

RigidPoses::MultibodyPoses* RigidPoses::multibody_of(const RigidPose& pose) {
  if (multibodies_.empty()) return nullptr;
  const btMultiBodyLinkCollider* const link = btMultiBodyLinkCollider::upcast(pose.object);
  const auto found = link ? multibodies_.find(link->m_multiBody) : multibodies_.end();
  return found == multibodies_.end() ? nullptr : &found->second;
}

void RigidPoses::jump_with_multibodies() {
  for (const RigidPose& pose : poses_) {
    MultibodyPoses* const multibody = multibody_of(pose);
    if (multibody) multibody->jumped = multibody->jumped || pose.jumped;
  }
  for (RigidPose& pose : poses_) {
    MultibodyPoses* const multibody = multibody_of(pose);
    if (multibody && multibody->jumped && pose.driven) jump(pose);
  }
}

void RigidPoses::let_driven_jump(const AxisBox& box) {
  for (RigidPose& pose : poses_)
    if (pose.driven && bounds(pose).overlaps(box)) jump(pose);
  jump_with_multibodies();
}

void RigidPoses::read_multibody_ends() {
  for (RigidPose& pose : poses_) {
    MultibodyPoses* const multibody = multibody_of(pose);
    if (multibody && !multibody->end)
      multibody->end = pose_of(*btMultiBodyLinkCollider::upcast(pose.object)->m_multiBody);
  }
}

void RigidPoses::take_link_ends() {
  for (RigidPose& pose : poses_) {
    MultibodyPoses* const multibody = multibody_of(pose);
    if (!multibody || !is_movable(*pose.object)) continue;
    pose.end = pose.object->getWorldTransform();
    multibody->end.reset();
  }
  read_multibody_ends();
}

void RigidPoses::set_response_end(int unique_id, const btTransform& end) {
  const auto known = known_.find(unique_id);
  if (known != known_.end()) poses_[known->second.index].end = end;
}

void RigidPoses::list_followed() {
  followed_.clear();
  for (std::size_t i = 0; i < poses_.size(); ++i)
    if (is_followed_[i]) followed_.push_back(&poses_[i]);
}

void RigidPoses::hold_at_start(const btCollisionObject& object) {
  for (RigidPose& pose : poses_) {
    if (pose.object != &object) continue;
    pose.end = pose.start;
    pose.at_rest = false;
  }
}

void RigidPoses::find(btBroadphaseInterface* broadphase) {
  if (!members_.may_have_changed(broadphase)) return;
  std::vector<RigidPose> found;
  // As if they had always been where they are.
  for_each_proxy(broadphase, [&found](const btBroadphaseProxy& proxy) {
    auto* const object = static_cast<btCollisionObject*>(proxy.m_clientObject);
    if (!is_rigid(*object)) return;
    const btTransform& now = object->getWorldTransform();
    found.push_back({object, proxy.m_uniqueId, now, now, now, now, now, now});
  });
  if (!are_known(found)) take(found);
}

bool RigidPoses::are_known(const std::vector<RigidPose>& found) const {
  return found.size() == known_.size() &&
         std::all_of(found.begin(), found.end(), [this](const RigidPose& pose) {
           const auto known = known_.find(pose.unique_id);
           return known != known_.end() && known->second.object == pose.object;
         });
}

void RigidPoses::take(std::vector<RigidPose>& found) {
  const auto before = [](const RigidPose& a, const RigidPose& b) {
    return a.unique_id < b.unique_id;
  };
  std::sort(found.begin(), found.end(), before);
  auto old = poses_.begin();
  known_.clear();
  for (RigidPose& pose : found) {
    known_.insert({pose.unique_id, {pose.object, known_.size()}});
    while (old != poses_.end() && before(*old, pose)) ++old;
    if (old == poses_.end() || before(pose, *old) || old->object != pose.object) {
      added_.push_back(pose.unique_id);
      continue;
    }
    // A static or kinematic body is swept from its pose at the end of the last step.
    pose = *old;
  }
  std::sort(added_.begin(), added_.end());
  poses_ = std::move(found);
  is_followed_.assign(poses_.size(), 1);
  list_followed();
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
