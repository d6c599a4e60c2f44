// How a rigid body moves that other rigid bodies support.
//
// Bullet solves the contacts between rigid bodies first. What soft bodies push afterwards must not
// move a body into what supports it, or along it as far as friction holds. So the body is as heavy
// as its support there, as in the shock propagation of Guendelman et al. 2003, "Nonconvex rigid
// bodies with stacking". It keeps the impulses as a velocity. Bullet's next solve passes it on to
// the support.
#pragma once

#include "lazyccd/bullet/precision.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

struct RigidMotion;
struct RigidSolution;

/// Translation (metres) and rotation (radians) of a body per impulse (kg m) and angular impulse
/// (kg m^2) on its centre.
using Mobility = Matrix6d;

/// A point of contact at which another rigid body supports this one.
struct Support {
  Vector3d normal,            ///< away from the other body
      arm;                    ///< from the centre of this body to the point, metres
  double load;                ///< Bullet's impulse along the normal in this step, kg m, >= 0
  Vector3d friction_impulse;  ///< Bullet's, across the normal, kg m
  double friction;            ///< Coulomb's coefficient
  bool slides = false;        ///< friction does not hold the point

  /// Displacement of the point per translation and rotation of the body.
  Matrix<3, 6> jacobian() const;
};

/// Mobility of a body without its supports.
Mobility free_mobility(const RigidMotion& body);

/// RigidSolution::supported_mobility: no support moves along its normal, in either direction, or
/// across it if it does not slide. Empty without supports.
std::optional<Mobility> mobility_at_supports(const RigidMotion& body);

/// A support only pushes: it may lose its load, but not hold the body. And its friction is within
/// Coulomb's cone. Lets the body leave the supports that `impulse`, the sum of what soft bodies
/// exert, pulls it off, and slide where friction does not hold it. Returns whether it does.
bool leave_supports(const RigidMotion& body, const Vector6d& impulse, RigidSolution& solution);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
