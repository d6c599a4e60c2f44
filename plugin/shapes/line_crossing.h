// Where lines parallel to the z axis pass through triangles.
//
// Of triangles that share a side, a line passes through exactly one on each side of it, wherever it
// meets the side: points on the line of a side count as moved by an infinitesimal distance
// (Edelsbrunner and Mücke 1990, "Simulation of simplicity").
#pragma once

#include <tuple>

#include "lazyccd/bullet/precision.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Side of the line from a to b on which p lies, seen along -z: 1 left, -1 right. 0 if a and b are
/// at the same place. The line from b to a gives the opposite, also with rounding.
inline int side_of_line(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  if (std::make_tuple(b[0], b[1]) < std::make_tuple(a[0], a[1])) return -side_of_line(p, b, a);
  const double across = (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
  for (const double value : {across, a[1] - b[1], b[0] - a[0]})
    if (value != 0) return value > 0 ? 1 : -1;
  return 0;
}

struct LineCrossing {
  /// 1 if the triangle's normal points to +z, -1 if to -z; 0 if the line does not pass through it.
  int sign;
  double z;  ///< of the place
};

inline LineCrossing line_crossing(const Vector3d& p, const Vector3d& a, const Vector3d& b,
                                  const Vector3d& c) {
  const int sign = side_of_line(p, a, b);
  if (sign == 0 || side_of_line(p, b, c) != sign || side_of_line(p, c, a) != sign) return {0, 0};
  const auto area = [&p](const Vector3d& u, const Vector3d& v) {
    return (u[0] - p[0]) * (v[1] - p[1]) - (u[1] - p[1]) * (v[0] - p[0]);
  };
  const double of_a = area(b, c), of_b = area(c, a), of_c = area(a, b), sum = of_a + of_b + of_c;
  return {sign, sum == 0 ? a[2] : (of_a * a[2] + of_b * b[2] + of_c * c[2]) / sum};
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
