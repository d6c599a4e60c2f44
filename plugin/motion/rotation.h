// Rotations as matrices and as rotation vectors (axis times angle, radians).
#pragma once

#include <LinearMath/btMatrix3x3.h>

#include <Eigen/Dense>
#include <Eigen/Geometry>

#include "lazyccd/bullet/precision.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

inline Eigen::Matrix3d to_eigen(const btMatrix3x3& m) {
  Eigen::Matrix3d result;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) result(i, k) = static_cast<double>(m[i][k]);
  }
  return result;
}

/// Rotation matrix of a rotation vector.
inline Eigen::Matrix3d rotation_by(const Eigen::Vector3d& rotation) {
  const double angle = rotation.norm();
  if (angle == 0) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, rotation / angle).toRotationMatrix();
}

/// Rotation vector of a rotation matrix.
inline Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd angle_axis(rotation);
  return angle_axis.angle() * angle_axis.axis();
}

/// Adds to `inertia` the inertia tensor about the origin of a point mass at `arm`.
inline void add_inertia(double mass, const Eigen::Vector3d& arm, Eigen::Matrix3d& inertia) {
  inertia += mass * (arm.squaredNorm() * Eigen::Matrix3d::Identity() - arm * arm.transpose());
}

/// Solves inertia * x = momentum: angular velocity from angular momentum, or rotation from angular
/// momentum times time. Components about axes without inertia are zero.
inline Eigen::Vector3d rotation_from_momentum(const Eigen::Matrix3d& inertia,
                                              const Eigen::Vector3d& momentum) {
  const double mean = inertia.trace() / 3;
  if (inertia.determinant() > 1e-3 * mean * mean * mean) return inertia.inverse() * momentum;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(inertia);
  const double smallest = 1e-9 * axes.eigenvalues()[2];
  Eigen::Vector3d result = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    if (axes.eigenvalues()[k] <= smallest) continue;
    const Eigen::Vector3d axis = axes.eigenvectors().col(k);
    result += axis.dot(momentum) / axes.eigenvalues()[k] * axis;
  }
  return result;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
