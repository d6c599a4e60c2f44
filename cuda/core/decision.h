// From the points of a query to its decision in double precision: what remains is for exact
// arithmetic.
#pragma once

#include "core/subdivision.h"

namespace lazyccd {

// The four points of a query at both ends of the step, in the order of Contact::vertices.
struct QueryCoordinates {
  Vec3<double> start[4], end[4];
};

// Differences times `scale`, a power of two that brings them to at most 2^6 (see elementary.h).
template <ContactKind kind>
LAZYCCD_HD inline Differences<double> differences(const QueryCoordinates& q, double scale) {
  constexpr bool vf = kind == ContactKind::vertex_face;
  // vertex-face: p a b c -> e1 = b - a, e2 = c - a, r = p - a; edge-edge: a b c d -> b - a, d - c,
  // c - a.
  constexpr int from1 = vf ? 1 : 0, to1 = vf ? 2 : 1, from2 = vf ? 1 : 2, to2 = 3;
  constexpr int from3 = vf ? 1 : 0, to3 = vf ? 0 : 2;
  Differences<double> d;
  for (int end = 0; end < 2; ++end) {
    const Vec3<double>* p = end ? q.end : q.start;
    d.e1[end] = scale * (p[to1] - p[from1]);
    d.e2[end] = scale * (p[to2] - p[from2]);
    d.r[end] = scale * (p[to3] - p[from3]);
  }
  return d;
}

// hit: with the tick of Contact::toi; miss; or undecided.
struct Decision {
  enum Kind : std::int32_t { miss, hit, undecided } kind;
  std::int64_t tick;
};

// A hit found in either precision: its time in ticks.
LAZYCCD_HD inline Decision timed_hit(const Cubic<double>& f, double lo, double hi) {
  const std::int64_t tick = impact_tick(f, lo, hi);
  return {tick < 0 ? Decision::undecided : Decision::hit, tick};
}

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

// More than h apart along x, y or z: the coordinate of every point of one primitive exceeds that of
// every point of the other, at both ends. A rounded difference exceeds h only where the true one
// does, so no bound is needed.
template <ContactKind kind>
LAZYCCD_HD inline bool separated_along_axes(const QueryCoordinates& q, double h = 0) {
  constexpr int split = kind == ContactKind::vertex_face ? 1 : 2;
  const double Vec3<double>::*const axes[3] = {&Vec3<double>::x, &Vec3<double>::y,
                                               &Vec3<double>::z};
  for (const auto axis : axes) {
    bool above = true, below = true;
    for (int end = 0; end < 2; ++end) {
      const Vec3<double>* p = end ? q.end : q.start;
      for (int i = 0; i < split; ++i) {
        for (int j = split; j < 4; ++j) {
          above = above && p[i].*axis - p[j].*axis > h;
          below = below && p[j].*axis - p[i].*axis > h;
        }
      }
    }
    if (above || below) return true;
  }
  return false;
}

}  // namespace lazyccd
