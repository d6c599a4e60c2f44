#include "untangling/face_geometry.h"

#include <algorithm>

#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

double rounding_at(const Vector3d& x) {
  return 16 * static_cast<double>(SIMD_EPSILON) * std::max(1.0, x.cwiseAbs().maxCoeff());
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

// Ericson 2005, "Real-Time Collision Detection", section 5.1.5.
Vector3d FaceGeometry::closest_point(std::int32_t index, const Vector3d& x) const {
  const Vector3d a = corner(index, 0), b = corner(index, 1), c = corner(index, 2);
  const Vector3d ab = b - a, ac = c - a, ap = x - a, bp = x - b, cp = x - c;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + d1 / (d1 - d3) * ab;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + d2 / (d2 - d6) * ac;
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 >= d3 && d5 >= d6) return b + (d4 - d3) / (d4 - d3 + d5 - d6) * (c - b);
  return a + vb / (va + vb + vc) * ab + vc / (va + vb + vc) * ac;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
