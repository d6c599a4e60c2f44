#include "motion/rigid_displacement.h"

#include <BulletCollision/CollisionShapes/btCollisionShape.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>
#include <LinearMath/btTransformUtil.h>

#include <vector>

#include "settings.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

btScalar radius_of(const btCollisionObject& object) {
  btVector3 centre;
  btScalar radius;
  object.getCollisionShape()->getBoundingSphere(centre, radius);
  return btMin(centre.length() + radius, btScalar(settings::displacement::max_radius));
}

// Number of time steps in which the velocity makes as much of the displacement as it can.
btScalar steps_explained(const btCollisionObject& object, const btTransform& from,
                         const btTransform& to, const RigidVelocity& velocity, btScalar dt) {
  const btVector3 step = dt * velocity.linear;
  const btScalar turn = dt * velocity.angular.length();
  btScalar steps = 1;
  if (step.length() >= turn * radius_of(object)) {
    if (step.length2() > 0) steps = step.dot(to.getOrigin() - from.getOrigin()) / step.length2();
  } else {
    btVector3 axis;
    btScalar angle;
    btTransformUtil::calculateDiffAxisAngle(from, to, axis, angle);
    steps = angle / turn;
  }
  return btMax(btScalar(0), btMin(steps, object.isStaticOrKinematicObject()
                                             ? btScalar(settings::displacement::max_substeps)
                                             : btScalar(1)));
}

}  // namespace

RigidVelocity velocity_of(const btCollisionObject& object) {
  if (const btRigidBody* const body = btRigidBody::upcast(&object))
    return {body->getLinearVelocity(), body->getAngularVelocity()};
  if (const btMultiBodyLinkCollider* const link = btMultiBodyLinkCollider::upcast(&object)) {
    const btMultiBody& body = *link->m_multiBody;
    const auto count = static_cast<std::size_t>(body.getNumLinks()) + 1;
    std::vector<btVector3> angular(count), linear(count);  // base first, in the links' own frames
    body.compTreeLinkVelocities(angular.data(), linear.data());
    const auto index = static_cast<std::size_t>(link->m_link + 1);
    return {body.localDirToWorld(link->m_link, linear[index]),
            body.localDirToWorld(link->m_link, angular[index])};
  }
  return {btVector3(0, 0, 0), btVector3(0, 0, 0)};
}

btTransform integrate(const btTransform& pose, const RigidVelocity& velocity, btScalar time) {
  btTransform moved;
  btTransformUtil::integrateTransform(pose, velocity.linear, velocity.angular, time, moved);
  return moved;
}

btScalar max_point_displacement(const btCollisionObject& object, const btTransform& from,
                                const btTransform& to) {
  const btMatrix3x3 basis_change = to.getBasis() - from.getBasis();
  const btScalar rotation =
      basis_change[0].length() + basis_change[1].length() + basis_change[2].length();
  return from.getOrigin().distance(to.getOrigin()) + rotation * radius_of(object);
}

btTransform part_way(const btTransform& from, const btTransform& to, btScalar fraction) {
  btTransform pose = to;
  pose.setOrigin(from.getOrigin().lerp(to.getOrigin(), fraction));
  if (!(from.getBasis() == to.getBasis()))
    pose.setRotation(from.getRotation().slerp(to.getRotation(), fraction));
  return pose;
}

btTransform spread_over_substeps(const btCollisionObject& object, const btTransform& last,
                                 const btTransform& now, btScalar dt) {
  const btRigidBody* const body = btRigidBody::upcast(&object);
  // Whoever moves a body during a frame does not set the pose that Bullet's velocity leads to.
  if (!body || !body->isKinematicObject() || !(body->getInterpolationWorldTransform() == now))
    return now;
  const btScalar steps = steps_explained(object, last, now, velocity_of(object), dt);
  return steps > btScalar(settings::displacement::min_steps_to_spread)
             ? part_way(last, now, 1 / steps)
             : now;
}

bool is_jump(const btCollisionObject& object, const RigidDisplacement& displacement, btScalar dt,
             btScalar jump_speed) {
  const auto& [before_last, last, now, driven] = displacement;
  if (last == now) return false;
  const btScalar moved = max_point_displacement(object, last, now);
  btScalar small = jump_speed * dt;
  // Bullet moves dynamic bodies out of each other without velocity (split impulse).
  if (!object.isStaticOrKinematicObject() && !driven)
    small =
        btMax(small, btScalar(settings::displacement::split_impulse_fraction) * radius_of(object));
  if (moved <= small) return false;
  const RigidVelocity velocity = velocity_of(object);
  const btScalar steps = steps_explained(object, last, now, velocity, dt);
  const btScalar beyond_velocity =
      max_point_displacement(object, integrate(last, velocity, steps * dt), now);
  if (beyond_velocity <= btScalar(settings::displacement::velocity_tolerance) * moved + small)
    return false;
  const btTransform driven_on = last * before_last.inverse() * last;
  const btScalar moved_last = max_point_displacement(object, before_last, last);
  return max_point_displacement(object, driven_on, now) >
         btScalar(settings::displacement::drive_tolerance) * moved_last + small;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
