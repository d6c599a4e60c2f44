// Tells whether a rigid body moved during a step or was put elsewhere by the application.
//
// A displacement is a motion if one of these explains it:
//  - The velocity of the body. Bullet computes that of a kinematic body from its motion state. As
//    Bullet moves kinematic bodies in the first of several substeps, it may be a multiple of it;
//    spread_over_substeps() makes equal parts of it.
//  - The displacement of the step before, to a half: the application drives the body.
//  - Its size: beyond the above, no point moves faster than SolverOptions::jump_speed. A dynamic
//    body that only Bullet moved may also move by a quarter of its radius, as split impulses do.
// Any other displacement is a jump: the body is new at its place, and nothing is swept.
#pragma once

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>

#include "lazyccd/bullet/precision.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Linear velocity, m/s, and angular velocity, rad/s, in the world frame.
struct RigidVelocity {
  btVector3 linear, angular;
};

/// Velocity of a rigid body or of a link of a multibody; zero for other objects.
RigidVelocity velocity_of(const btCollisionObject& object);

/// Pose after moving from `pose` with `velocity` for `time` seconds, which may be negative.
btTransform integrate(const btTransform& pose, const RigidVelocity& velocity, btScalar time);

/// Upper estimate of the displacement of the object's points between two poses, metres.
btScalar max_point_displacement(const btCollisionObject& object, const btTransform& from,
                                const btTransform& to);

/// Pose on the way between two poses, at a fraction of it.
btTransform part_way(const btTransform& from, const btTransform& to, btScalar fraction);

/// Bullet moves a kinematic rigid body by its motion of a whole frame before the first substep.
/// Returns where the body is at the end of a substep of `dt` seconds if it moves on from `last`
/// with its velocity: `now`, Bullet's pose, or a pose on the way to it.
btTransform spread_over_substeps(const btCollisionObject& object, const btTransform& last,
                                 const btTransform& now, btScalar dt);

/// The poses of a body at the ends of two consecutive steps.
struct RigidDisplacement {
  btTransform before_last, last, now;
  bool driven = false;  ///< the application moved the body, whether it is dynamic or not
};

/// True if the application put the body elsewhere between `last` and `now`, a step of `dt` seconds.
/// `jump_speed`: as in SolverOptions.
bool is_jump(const btCollisionObject& object, const RigidDisplacement& displacement, btScalar dt,
             btScalar jump_speed);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
