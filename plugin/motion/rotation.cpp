#include "motion/rotation.h"

#include <Eigen/Geometry>

#include "util/decompositions.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

Matrix3d rotation_by(const Vector3d& rotation) {
  const double angle = rotation.norm();
  if (angle == 0) return Matrix3d::Identity();
  const Vector3d axis = rotation / angle;
  Matrix3d result;
  Eigen::Map<Eigen::Matrix3d>(result.data()) =
      Eigen::AngleAxisd(angle, Eigen::Vector3d(axis.data())).toRotationMatrix();
  return result;
}

Vector3d rotation_vector(const Matrix3d& rotation) {
  const Eigen::AngleAxisd turn(Eigen::Matrix3d(rotation.data()));
  return turn.angle() * Vector3d(turn.axis().x(), turn.axis().y(), turn.axis().z());
}

Vector3d rotation_from_momentum(const Matrix3d& inertia, const Vector3d& momentum) {
  constexpr double well_conditioned = 1e-3;  // costs less then: no eigenvalues are needed
  constexpr double rounding = 1e-9;          // of an eigenvalue, relative to the largest
  const double mean = inertia.trace() / 3;
  if (inertia.determinant() > well_conditioned * mean * mean * mean)
    return inertia.inverse() * momentum;
  const SymmetricEigen<3> axes(inertia);
  const double smallest = rounding * axes.values[2];
  Vector3d result = Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    if (axes.values[k] <= smallest) continue;
    const Vector3d axis = axes.vectors.col(k);
    result += axis.dot(momentum) / axes.values[k] * axis;
  }
  return result;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
