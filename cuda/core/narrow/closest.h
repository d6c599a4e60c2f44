// Closest points of the two primitives at one time, in plain arithmetic. Takes the best of all
// pairs of features, so degenerate primitives need no special care. Nothing certified relies on the
// accuracy.
#pragma once

#include "core/lane.h"
#include "core/vec.h"
#include "lazyccd/contact.h"

namespace lazyccd {

template <class T>
struct ClosestPoints {
  T u, v;       // as in Contact
  Vec3<T> gap;  // vertex-face: from the face to the vertex; edge-edge: from edge a to edge b
};

template <class T>
LAZYCCD_HD inline T clamp01(const T& x) {
  return select(x > T(0.0), select(x < T(1.0), x, T(1.0)), T(0.0));
}
template <class T>
LAZYCCD_HD inline Vec3<T> select(const MaskOf<T>& m, const Vec3<T>& a, const Vec3<T>& b) {
  return {select(m, a.x, b.x), select(m, a.y, b.y), select(m, a.z, b.z)};
}

/// How closest_points() divides: with the same bits on every backend, or as an estimate.
struct IeeeDivision {
  template <class T>
  LAZYCCD_HD static T quotient(const T& a, const T& b) {
    return a / b;
  }
};
struct EstimatedDivision {
  template <class T>
  LAZYCCD_HD static T quotient(const T& a, const T& b) {
    return estimated_quotient(a, b);
  }
};

/// Returns the closest points. vertex-face: the vertex at r, the face (0, e1, e2). edge-edge: edge
/// a from 0 to e1, edge b from r to r + e2.
template <ContactKind kind, class Division = IeeeDivision, class T>
LAZYCCD_HD inline ClosestPoints<T> closest_points(const Vec3<T>& e1, const Vec3<T>& e2,
                                                  const Vec3<T>& r) {
  using Mask = MaskOf<T>;
  constexpr bool vf = kind == ContactKind::vertex_face;
  const T zero = T(0.0), one = T(1.0);
  const T a = dot(e1, e1), b = dot(e1, e2), c = dot(e2, e2), p = dot(e1, r), q = dot(e2, r);
  ClosestPoints<T> best{zero, zero, {zero, zero, zero}};
  T best_squared = T(-1.0);
  const auto consider = [&](const T& u, const T& v, const Mask& valid) {
    if (!lane_any(valid)) return;
    const Vec3<T> gap = vf ? r - (u * e1 + v * e2) : (r + v * e2) - u * e1;
    const T size = dot(gap, gap);
    const Mask better = Mask(valid & !Mask((best_squared >= zero) & !Mask(size < best_squared)));
    best_squared = select(better, size, best_squared);
    best.u = select(better, u, best.u);
    best.v = select(better, v, best.v);
    best.gap = select<T>(better, gap, best.gap);
  };
  const auto ratio = [&](const T& num, const T& den) {
    return select(den > zero, Division::quotient(num, den), zero);
  };
  // The point pair whose gap is normal to both e1 and e2.
  const T det = a * c - b * b;
  const T u = ratio(T(c * p - b * q), det), v = ratio(T(vf ? a * q - b * p : b * p - a * q), det);
  const Mask always = Mask(zero < one);
  if (vf) {
    const T side = clamp01(ratio(T(a + q - b - p), T(a - b - b + c)));
    consider(clamp01(ratio(p, a)), zero, always);
    consider(zero, clamp01(ratio(q, c)), always);
    consider(one - side, side, always);
    consider(u, v, Mask((det > zero) & (u > zero) & (v > zero) & (u + v < one)));
  } else {
    consider(zero, clamp01(ratio(T(-q), c)), always);
    consider(one, clamp01(ratio(T(b - q), c)), always);
    consider(clamp01(ratio(p, a)), zero, always);
    consider(clamp01(ratio(T(p + b), a)), one, always);
    consider(u, v, Mask((det > zero) & (u > zero) & (u < one) & (v > zero) & (v < one)));
  }
  return best;
}

}  // namespace lazyccd
