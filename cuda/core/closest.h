// Closest points of the two primitives at one time, in plain arithmetic: the best of all pairs of
// features, so that degenerate primitives need no care. Nothing certified relies on their accuracy.
#pragma once

#include "core/vec.h"
#include "lazyccd/contact.h"

namespace lazyccd {

struct ClosestPoints {
  double u, v;     // as in Contact
  Vec3<double> gap;  // vertex-face: from the face to the vertex; edge-edge: from edge a to edge b
};

LAZYCCD_HD inline double clamp01(double x) { return x > 0 ? (x < 1 ? x : 1) : 0; }
LAZYCCD_HD inline double ratio(double num, double den) { return den > 0 ? num / den : 0; }

// The vertex at r, the face (0, e1, e2); or edge a from 0 to e1, edge b from r to r + e2.
template <ContactKind kind>
LAZYCCD_HD inline ClosestPoints closest_points(const Vec3<double>& e1, const Vec3<double>& e2,
                                               const Vec3<double>& r) {
  constexpr bool vf = kind == ContactKind::vertex_face;
  const double a = dot(e1, e1), b = dot(e1, e2), c = dot(e2, e2), p = dot(e1, r), q = dot(e2, r);
  ClosestPoints best{};
  double least = -1;
  const auto consider = [&](double u, double v) {
    const Vec3<double> gap = vf ? r - (u * e1 + v * e2) : (r + v * e2) - u * e1;
    const double size = dot(gap, gap);
    if (least >= 0 && !(size < least)) return;
    least = size;
    best = {u, v, gap};
  };
  // Where the gap is normal to both e1 and e2.
  const double det = a * c - b * b;
  const double u = ratio(c * p - b * q, det), v = ratio(vf ? a * q - b * p : b * p - a * q, det);
  if (vf) {
    const double side = clamp01(ratio(a + q - b - p, a - b - b + c));
    consider(clamp01(ratio(p, a)), 0);
    consider(0, clamp01(ratio(q, c)));
    consider(1 - side, side);
    if (det > 0 && u > 0 && v > 0 && u + v < 1) consider(u, v);
  } else {
    consider(0, clamp01(ratio(-q, c)));
    consider(1, clamp01(ratio(b - q, c)));
    consider(clamp01(ratio(p, a)), 0);
    consider(clamp01(ratio(p + b, a)), 1);
    if (det > 0 && u > 0 && u < 1 && v > 0 && v < 1) consider(u, v);
  }
  return best;
}

}  // namespace lazyccd
