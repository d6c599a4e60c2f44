// Closest points of the two primitives at one time, in plain arithmetic (Ericson, Real-Time Collision
// Detection, 2005, sections 5.1.5 and 5.1.9). Nothing certified relies on their accuracy.
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

// The vertex at r, the face (0, e1, e2).
LAZYCCD_HD inline ClosestPoints closest_vertex_face(const Vec3<double>& e1, const Vec3<double>& e2,
                                                    const Vec3<double>& r) {
  const double d1 = dot(e1, r), d2 = dot(e2, r);
  const double a = dot(e1, e1), b = dot(e1, e2), c = dot(e2, e2);
  const double d3 = d1 - a, d4 = d2 - b, d5 = d1 - b, d6 = d2 - c;
  const double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
  double u, v;
  if (d1 <= 0 && d2 <= 0) {
    u = v = 0;
  } else if (d3 >= 0 && d4 <= d3) {
    u = 1, v = 0;
  } else if (d6 >= 0 && d5 <= d6) {
    u = 0, v = 1;
  } else if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    u = ratio(d1, d1 - d3), v = 0;
  } else if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    u = 0, v = ratio(d2, d2 - d6);
  } else if (va <= 0 && d4 >= d3 && d5 >= d6) {
    v = ratio(d4 - d3, (d4 - d3) + (d5 - d6)), u = 1 - v;
  } else {
    u = ratio(vb, va + vb + vc), v = ratio(vc, va + vb + vc);
  }
  return {u, v, r - (u * e1 + v * e2)};
}

// Edge a from 0 to e1, edge b from r to r + e2.
LAZYCCD_HD inline ClosestPoints closest_edge_edge(const Vec3<double>& e1, const Vec3<double>& e2,
                                                  const Vec3<double>& r) {
  const double a = dot(e1, e1), b = dot(e1, e2), e = dot(e2, e2);
  const double c = -dot(e1, r), f = -dot(e2, r);
  const double den = a * e - b * b;
  double u = den > 0 ? clamp01((b * f - c * e) / den) : 0;
  double v = ratio(b * u + f, e);
  if (!(v >= 0)) {
    v = 0;
    u = clamp01(ratio(-c, a));
  } else if (v > 1) {
    v = 1;
    u = clamp01(ratio(b - c, a));
  }
  return {u, v, (r + v * e2) - u * e1};
}

template <ContactKind kind>
LAZYCCD_HD inline ClosestPoints closest_points(const Vec3<double>& e1, const Vec3<double>& e2,
                                               const Vec3<double>& r) {
  if constexpr (kind == ContactKind::vertex_face) {
    return closest_vertex_face(e1, e2, r);
  } else {
    return closest_edge_edge(e1, e2, r);
  }
}

}  // namespace lazyccd
