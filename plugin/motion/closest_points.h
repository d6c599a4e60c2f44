// Closest points of segments and triangles, and what is below a point in the plane of a triangle.
#pragma once

#include <algorithm>
#include <array>

#include "lazyccd/bullet/precision.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Place of the point of a segment that is closest to x: 0 at its first end, 1 at its last one.
inline double place_on_segment(const Vector3d& x, const Vector3d& first, const Vector3d& last) {
  const Vector3d along = last - first;
  const double length2 = along.squaredNorm();
  return length2 > 0 ? std::clamp((x - first).dot(along) / length2, 0.0, 1.0) : 0;
}

struct ClosestOnSegments {
  double s, t;   ///< on a + s u and on b + t v, in [0, 1]
  Vector3d gap;  ///< from the second segment to the first
};

/// Ericson 2005, "Real-Time Collision Detection", section 5.1.9. Of parallel segments, s is 0 or at
/// an end of the second one.
inline ClosestOnSegments closest_on_segments(const Vector3d& a, const Vector3d& u,
                                             const Vector3d& b, const Vector3d& v) {
  const Vector3d w = a - b;
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), vw = v.dot(w);
  double s = 0, t = 0;
  if (!(vv > 0)) {
    s = uu > 0 ? std::clamp(-u.dot(w) / uu, 0.0, 1.0) : 0;
  } else {
    const double uv = u.dot(v), uw = u.dot(w), area = uu * vv - uv * uv;
    if (area > 0) s = std::clamp((uv * vw - uw * vv) / area, 0.0, 1.0);
    t = (uv * s + vw) / vv;
    if (t < 0 || t > 1) {
      t = std::clamp(t, 0.0, 1.0);
      s = uu > 0 ? std::clamp((uv * t - uw) / uu, 0.0, 1.0) : 0;
    }
  }
  return {s, t, w + s * u - t * v};
}

/// The plane of a triangle.
struct TrianglePlane {
  Vector3d corner, ab, ac, across;  ///< across: its normal, as long as twice its area, m^2
  double across_squared;            ///< 0: the triangle has no plane

  TrianglePlane(const Vector3d& a, const Vector3d& b, const Vector3d& c)
      : corner(a),
        ab(b - a),
        ac(c - a),
        across(ab.cross(ac)),
        across_squared(across.squaredNorm()) {}

  bool exists() const { return across_squared > 0; }
  /// Barycentric coordinates of the point of the plane below x, by corner. Needs a plane.
  std::array<double, 3> weights_below(const Vector3d& x) const {
    const double u = across.dot((x - corner).cross(ac)) / across_squared,
                 v = across.dot(ab.cross(x - corner)) / across_squared;
    return {1 - u - v, u, v};
  }
};

/// Barycentric coordinates of the point on the edges of a triangle that is closest to x, by corner.
inline std::array<double, 3> closest_on_triangle_edges(const Vector3d& x, const Vector3d& a,
                                                       const Vector3d& b, const Vector3d& c) {
  const std::array<Vector3d, 3> corners = {a, b, c};
  std::array<double, 3> closest = {1, 0, 0};
  double least = (x - a).squaredNorm();
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t k = (i + 1) % 3;
    const double place = place_on_segment(x, corners[i], corners[k]);
    const double squared = (x - (1 - place) * corners[i] - place * corners[k]).squaredNorm();
    if (squared >= least) continue;
    least = squared;
    closest = {0, 0, 0};
    closest[i] = 1 - place;
    closest[k] = place;
  }
  return closest;
}

/// Barycentric coordinates of the point of a triangle that is closest to x, by corner. Ericson
/// 2005, "Real-Time Collision Detection", section 5.1.5. A triangle may have no area.
inline std::array<double, 3> closest_on_triangle(const Vector3d& x, const Vector3d& a,
                                                 const Vector3d& b, const Vector3d& c) {
  if (!TrianglePlane(a, b, c).exists()) return closest_on_triangle_edges(x, a, b, c);
  const Vector3d ab = b - a, ac = c - a, ap = x - a, bp = x - b, cp = x - c;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {1 - d1 / (d1 - d3), d1 / (d1 - d3), 0};
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)};
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 >= d3 && d5 >= d6) {
    const double along = (d4 - d3) / (d4 - d3 + d5 - d6);
    return {0, 1 - along, along};
  }
  const double v = vb / (va + vb + vc), w = vc / (va + vb + vc);
  return {1 - v - w, v, w};
}

/// True if these barycentric coordinates are of a point in the triangle.
inline bool is_inside(const std::array<double, 3>& weights) {
  return weights[0] >= 0 && weights[1] >= 0 && weights[2] >= 0;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
