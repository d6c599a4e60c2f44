// From the points of a query to its decision in double precision. Queries that stay undecided go on
// to exact arithmetic.
#pragma once

#include "core/narrow/subdivision.h"

namespace lazyccd {

/// The four points of a query at both ends of the step, in the order of Contact::vertices.
template <class T>
struct CoordinatesOf {
  Vec3<T> start[4], end[4];
};
using QueryCoordinates = CoordinatesOf<double>;

/// Returns the position differences times `power`, a power of two that brings them to at most 2^6
/// (see elementary.h).
template <ContactKind kind, class T>
LAZYCCD_HD inline Differences<T> differences(const CoordinatesOf<T>& q, double power) {
  const T scale = T(power);
  constexpr bool vf = kind == ContactKind::vertex_face;
  // Which points each difference is between:
  //   vertex-face, p a b c: e1 = b - a, e2 = c - a, r = p - a
  //   edge-edge,   a b c d: e1 = b - a, e2 = d - c, r = c - a
  constexpr int from1 = vf ? 1 : 0, to1 = vf ? 2 : 1, from2 = vf ? 1 : 2, to2 = 3;
  constexpr int from3 = vf ? 1 : 0, to3 = vf ? 0 : 2;
  Differences<T> d;
  for (int end = 0; end < 2; ++end) {
    const Vec3<T>* p = end ? q.end : q.start;
    d.e1[end] = scale * (p[to1] - p[from1]);
    d.e2[end] = scale * (p[to2] - p[from2]);
    d.r[end] = scale * (p[to3] - p[from3]);
  }
  return d;
}

/// The result for a query: a miss, a hit with its time, or undecided.
struct Decision {
  enum Kind : std::int32_t { miss, hit, undecided } kind;
  std::int64_t tick;  // of a hit: Contact::toi in units of 2^-32
};

/// Returns the decision for a hit that was found in either precision, with its time in ticks.
LAZYCCD_HD inline Decision timed_hit(const Cubic<double>& f, double lo, double hi) {
  const std::int64_t tick = impact_tick(f, lo, hi);
  return {tick < 0 ? Decision::undecided : Decision::hit, tick};
}

/// Decides a query in double precision, at the roots first and then by subdivision.
template <ContactKind kind>
LAZYCCD_HD inline Decision decide_in_double(const Differences<double>& d) {
  const Magnitudes<double> m = magnitudes(d);
  const Cubic<double> f = coplanarity(d, m);
  Verdict<double> v = decide_at_roots<kind>(d, m, f);
  if (!v.hit && !v.miss) v = decide_by_subdivision<kind>(d, m, f);
  if (v.miss) return {Decision::miss, 0};
  if (!v.hit) return {Decision::undecided, 0};
  return timed_hit(f, v.lo, v.hi);
}

/// Whether the primitives are more than h apart along x, y or z: at both ends of the step, the
/// coordinate of every point of one exceeds that of every point of the other by more than h. A
/// rounded difference exceeds h only if the exact one does, so no error bound is needed. Rounding
/// keeps the order, so the least difference decides.
template <ContactKind kind, class T>
LAZYCCD_HD inline MaskOf<T> separated_along_axes(const CoordinatesOf<T>& q, const T& h) {
  constexpr int split = kind == ContactKind::vertex_face ? 1 : 2;
  T Vec3<T>::*const axes[3] = {&Vec3<T>::x, &Vec3<T>::y, &Vec3<T>::z};
  MaskOf<T> separated = h < h;
  for (const auto axis : axes) {
    T above[2], below[2];
    for (int end = 0; end < 2; ++end) {
      const Vec3<T>* p = end ? q.end : q.start;
      T lo_a = p[0].*axis, hi_a = lo_a, lo_b = p[split].*axis, hi_b = lo_b;
      for (int i = 1; i < split; ++i)
        lo_a = lane_min(lo_a, p[i].*axis), hi_a = lane_max(hi_a, p[i].*axis);
      for (int i = split + 1; i < 4; ++i)
        lo_b = lane_min(lo_b, p[i].*axis), hi_b = lane_max(hi_b, p[i].*axis);
      above[end] = lo_a - hi_b;
      below[end] = lo_b - hi_a;
    }
    separated = MaskOf<T>(separated | ((above[0] > h) & (above[1] > h)) |
                          ((below[0] > h) & (below[1] > h)));
  }
  return separated;
}

template <ContactKind kind>
LAZYCCD_HD inline bool separated_along_axes(const QueryCoordinates& q) {
  return separated_along_axes<kind>(q, 0.0);
}

}  // namespace lazyccd
