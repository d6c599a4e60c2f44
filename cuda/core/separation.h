// Minimum separation: the first time at which two primitives come as near as h > 0, in double
// precision.
//
// Never missed, never late: every step in time below is covered by an axis along which all corners
// certainly stay more than h apart. What the bounds cannot tell from h counts as h; so does a pair
// that stays within 1e-7 of its size above h while it turns, for longer than kMaxAdvances steps.
//
// Backends cull with boxes, slabs and a filter of their own, and must report the same contacts. So
// each such test stands here too, in a form that is at least as sharp: what a backend culled with
// its wider margins is a miss here as well. The margins: positions by separation_margin(h) along
// axes; the filter in single precision by twice its bound and 2^-10 of h.
#pragma once

#include "core/closest.h"
#include "core/decision.h"

namespace lazyccd {

// By how much boxes grow on every side: half of h, and what keeps them wider than the exact test.
LAZYCCD_HD inline double separation_margin(double h) { return 0.5 * h * (1 + 0x1p-20); }

// How far n reaches during the step, from above: n is quadratic, in the hull of its control
// vectors.
template <class T>
LAZYCCD_HD inline T longest_normal(const Differences<T>& d, const Magnitudes<T>& m) {
  using S = typename Lane<T>::Scalar;
  const Vec3<T> n0 = cross(d.e1[0], d.e2[0]), n2 = cross(d.e1[1], d.e2[1]);
  const Vec3<T> mixed = cross(d.e1[0], d.e2[1]) + cross(d.e1[1], d.e2[0]);
  const T longest = lane_max(lane_max(dot(n0, n0), dot(n2, n2)), T(S(0.25)) * dot(mixed, mixed));
  return lane_sqrt(longest) + T(8 * Roundoff<S>::u) * (m.n.x + m.n.y + m.n.z);
}

// The planes through the primitives, parallel to both, stay more than h apart: the non-coplanar
// filter with |n . r| > h |n|. Twice the bound of f, and 2^14 roundings of h, keep single
// precision, on any backend, less sharp than double.
template <class T>
LAZYCCD_HD inline MaskOf<T> planes_apart(const Differences<T>& d, const Magnitudes<T>& m,
                                         const T& h) {
  using S = typename Lane<T>::Scalar;
  Cubic<T> f = coplanarity(d, m);
  f.bound = T(S(2)) * f.bound + T(S(1) + S(0x1p14) * Roundoff<S>::u) * h * longest_normal(d, m);
  return f.no_root();
}

// Along the diagonals x+y, x-y, x+z, x-z, y+z, y-z, at both ends, on one side.
template <ContactKind kind, class T>
LAZYCCD_HD inline MaskOf<T> separated_along_diagonals(const CoordinatesOf<T>& q, const T& h) {
  using Mask = MaskOf<T>;
  constexpr int split = kind == ContactKind::vertex_face ? 1 : 2;
  constexpr double root2 = 1.4142135623731;  // from above
  T Vec3<T>::*const axes[4] = {&Vec3<T>::x, &Vec3<T>::y, &Vec3<T>::z, &Vec3<T>::x};
  const T wide = T(root2) * h, rounding = T(4 * Roundoff<double>::u);
  const Mask none = Mask(h < h), all = Mask(!none);
  Mask separated = none;
  for (int k = 0; k < 3; ++k) {
    Mask above[2] = {all, all}, below[2] = {all, all};  // of the sum and of the difference
    for (int end = 0; end < 2; ++end) {
      const Vec3<T>* p = end ? q.end : q.start;
      for (int i = 0; i < split; ++i) {
        for (int j = split; j < 4; ++j) {
          const T a = p[i].*axes[k] - p[j].*axes[k], b = p[i].*axes[k + 1] - p[j].*axes[k + 1];
          const T least = wide + rounding * (lane_abs(a) + lane_abs(b));
          const T sum = a + b, difference = a - b;
          above[0] = Mask(above[0] & (sum > least));
          below[0] = Mask(below[0] & (-sum > least));
          above[1] = Mask(above[1] & (difference > least));
          below[1] = Mask(below[1] & (-difference > least));
        }
      }
    }
    separated = Mask(separated | above[0] | below[0] | above[1] | below[1]);
  }
  return separated;
}

// From t, when until? Up to then all corners of one primitive certainly stay more than h from the
// other along the axis; t itself where not even then, 2 where they do to the end of the step.
template <ContactKind kind, class T>
LAZYCCD_HD inline T apart_until(const Differences<T>& d, const Magnitudes<T>& m,
                                const Vec3<T>& axis, const T& h, const T& t) {
  using Mask = MaskOf<T>;
  constexpr int count = 4;
  T at[2][count];  // the corners at both ends
  for (int end = 0; end < 2; ++end) {
    const T r = dot(axis, d.r[end]), e1 = dot(axis, d.e1[end]), e2 = dot(axis, d.e2[end]);
    at[end][0] = r;
    at[end][1] = r - e1;
    at[end][2] = kind == ContactKind::vertex_face ? r - e2 : r + e2;
    at[end][3] = kind == ContactKind::vertex_face ? r : r + e2 - e1;
  }
  const Vec3<T> axis_abs{lane_abs(axis.x), lane_abs(axis.y), lane_abs(axis.z)};
  const T least = T(1 + 8 * Roundoff<double>::u) * h * lane_sqrt(dot(axis, axis)) +
                  T(16 * Roundoff<double>::u) * dot(axis_abs, m.r + m.e1 + m.e2) +
                  T(Roundoff<double>::tiny);
  const auto apart = [&](const T& time) {
    Mask all = Mask(lerp(at[0][0], at[1][0], time) > least);
    for (int i = 1; i < count; ++i) all = Mask(all & (lerp(at[0][i], at[1][i], time) > least));
    return all;
  };
  const Mask now = apart(t), to_the_end = apart(T(1.0));
  T until = T(1.0);
  if (lane_any(Mask(now & !to_the_end))) {
    for (int i = 0; i < count; ++i) {
      const T leaves = (at[0][i] - least) / (at[0][i] - at[1][i]);
      until = select(Mask(!Mask(at[1][i] > least)), lane_min(until, leaves), until);
    }
    until = until - T(0x1p-20) * (until - t);
    until = select(Mask((until > t) & apart(until)), until, t);
  }
  return select(now, select(to_the_end, T(2.0), until), t);
}

// A search on its way: the primitives stay apart up to t, and the next axis is that of the closest
// points at `ahead`, not before t.
template <class T>
struct Search {
  T t = T(0.0), ahead = T(0.0);
  T trust = T(1.0);  // in where the distance, as it changes now, would reach h
};

// A quarter of a tick of the time of impact: who advances less has arrived.
template <class T>
LAZYCCD_HD inline MaskOf<T> is_beyond(const T& next, const T& t) {
  return next - t > T(0x1p-34);
}

template <class T>
struct Advanced {
  MaskOf<T> missed, arrived;
};

// Conservative advancement (Mirtich 1996) along the axis through the closest points of a moment, as
// far as all corners stay apart along it. The axis of the moment in which the distance reaches h
// serves for all the time before it, so the moment is that of Newton's method, unless that axis
// does not hold from t on: then it is t. Where not even that one serves, the normal does, which is
// the same axis, and more exact, where the points lie inside. h in the units of d.
template <ContactKind kind, class T>
LAZYCCD_HD inline Advanced<T> advance(const Differences<T>& d, const Magnitudes<T>& m, const T& h,
                                      Search<T>& search) {
  using Mask = MaskOf<T>;
  const T t = search.t, one = T(1.0);
  const Vec3<T> e1 = lerp(d.e1, search.ahead), e2 = lerp(d.e2, search.ahead),
                r = lerp(d.r, search.ahead);
  const ClosestPoints<T> points = closest_points<kind>(e1, e2, r);
  T next = apart_until<kind>(d, m, points.gap, h, t);
  const Mask is_ahead = search.ahead > t;
  Mask stuck = !is_beyond(next, t);
  if (lane_any(Mask(stuck & !is_ahead))) {
    const Vec3<T> n = cross(e1, e2);
    const Vec3<T> facing = select<T>(dot(n, r) < T(0.0), T(-1.0) * n, n);
    next = select(Mask(stuck & !is_ahead), apart_until<kind>(d, m, facing, h, t), next);
    stuck = !is_beyond(next, t);
  }
  const Vec3<T> e1_moves = d.e1[1] - d.e1[0], e2_moves = d.e2[1] - d.e2[0],
                r_moves = d.r[1] - d.r[0];
  const Vec3<T> gap_moves = kind == ContactKind::vertex_face
                                ? r_moves - (points.u * e1_moves + points.v * e2_moves)
                                : (r_moves + points.v * e2_moves) - points.u * e1_moves;
  const T size = lane_sqrt(dot(points.gap, points.gap));
  const T closing = -dot(points.gap, gap_moves) / size;  // of the distance, in a step
  const T reached = select(closing > T(0.0), search.ahead + (size - h) / closing, one);

  const Mask arrived = stuck & !is_ahead;
  search.trust = select(stuck, T(0.5) * search.trust, search.trust);
  search.t = select(arrived, t, next);
  T ahead = next + search.trust * (reached - next);
  ahead = select(ahead < one, ahead, one);
  search.ahead = select(Mask(Mask(!stuck) & is_beyond(ahead, next)), ahead, next);
  return {next > one, arrived};
}

constexpr int kMaxAdvances = 4096;

// Contact::toi in ticks.
LAZYCCD_HD inline std::int64_t approach_tick(double t) {
  return static_cast<std::int64_t>(lane_floor(t * 4294967296.0));
}

// The whole test; `scale` as for differences().
template <ContactKind kind>
LAZYCCD_HD inline Decision decide_within(const QueryCoordinates& q, double h, double scale) {
  if (separated_along_axes<kind>(q, h) || separated_along_diagonals<kind>(q, h))
    return {Decision::miss, 0};
  const Differences<double> d = differences<kind>(q, scale);
  const Magnitudes<double> m = magnitudes(d);
  if (planes_apart(d, m, h * scale)) return {Decision::miss, 0};
  Search<double> search;
  for (int advances = 0; advances < kMaxAdvances; ++advances) {
    const Advanced<double> advanced = advance<kind>(d, m, h * scale, search);
    if (advanced.missed) return {Decision::miss, 0};
    if (advanced.arrived) break;
  }
  return {Decision::hit, approach_tick(search.t)};
}

}  // namespace lazyccd
