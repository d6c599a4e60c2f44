// Rotations as matrices and as rotation vectors (axis times angle, radians).
#pragma once

#include <LinearMath/btMatrix3x3.h>

#include "lazyccd/bullet/precision.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

inline Matrix3d to_double(const btMatrix3x3& m) {
  Matrix3d result;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) result(i, k) = static_cast<double>(m[i][k]);
  }
  return result;
}

/// Rotation matrix of a rotation vector.
Matrix3d rotation_by(const Vector3d& rotation);

/// Rotation vector of a rotation matrix.
Vector3d rotation_vector(const Matrix3d& rotation);

/// Adds to `inertia` the inertia tensor about the origin of a point mass at `arm`.
inline void add_inertia(double mass, const Vector3d& arm, Matrix3d& inertia) {
  inertia += mass * (arm.squaredNorm() * Matrix3d::Identity() - arm * arm.transpose());
}

/// Solves inertia * x = momentum: angular velocity from angular momentum, or rotation from angular
/// momentum times time. Components about axes without inertia are zero.
Vector3d rotation_from_momentum(const Matrix3d& inertia, const Vector3d& momentum);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
