#include "untangling/face_geometry.h"

#include <algorithm>
#include <array>

#include "motion/closest_points.h"
#include "motion/rounding.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

bool is_below(const Side& side, const Vector3d& x, const Vector3d& origin) {
  return side.height(x) < -rounding_along(side.normal, x.cwiseAbs() + origin.cwiseAbs());
}

double rounding_at(const Vector3d& x) {
  return rounding_of(std::max(1.0, x.cwiseAbs().maxCoeff()));
}

bool FaceGeometry::is_degenerate(std::int32_t index) const {
  const Vector3d a = corner(index, 0), ab = corner(index, 1) - a, ac = corner(index, 2) - a;
  const double longest = std::max({ab.norm(), ac.norm(), (ac - ab).norm()});
  return !(ab.cross(ac).norm() > rounding_at(a) * longest);
}

Side FaceGeometry::side_of(std::int32_t index, const Vector3d& up) const {
  const Vector3d a = corner(index, 0);
  Vector3d normal = (corner(index, 1) - a).cross(corner(index, 2) - a).normalized();
  if (normal.dot(up) < 0) normal = -normal;
  return {index, normal, normal.dot(a)};
}

bool FaceGeometry::covers(std::int32_t index, const Vector3d& axis, const Vector3d& x) const {
  const Vector3d a = corner(index, 0) - x, b = corner(index, 1) - x, c = corner(index, 2) - x;
  const double u = axis.dot(a.cross(b)), v = axis.dot(b.cross(c)), w = axis.dot(c.cross(a));
  return (u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0);
}

Vector3d FaceGeometry::closest_point(std::int32_t index, const Vector3d& x) const {
  const Vector3d a = corner(index, 0), b = corner(index, 1), c = corner(index, 2);
  const std::array<double, 3> weights = closest_on_triangle(x, a, b, c);
  return weights[0] * a + weights[1] * b + weights[2] * c;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
