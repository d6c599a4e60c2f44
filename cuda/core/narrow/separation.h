// Minimum separation: finds the first time at which two primitives come as near as h > 0, in double
// precision.
//
// Never a miss and never late: every step in time below is covered by an axis along which all
// corners certainly stay more than h apart. A distance that the bounds cannot tell from h counts as
// h. So does a pair that turns while it stays within 1e-7 of its size above h, for longer than
// kMaxAdvances steps.
//
// Each backend culls with boxes, slabs and a filter of its own, and all must report the same
// contacts. So each such test is repeated here, in a form that is at least as sharp: a pair that a
// backend culls with its wider margins is a miss here too. The margins: separation_margin(h) for
// positions along axes; twice the bound and 2^-10 of h for the filter in single precision.
#pragma once

#include "core/narrow/closest.h"
#include "core/narrow/decision.h"

namespace lazyccd {

/// Returns by how much boxes grow on every side: half of h, plus what keeps them wider than the
/// exact test.
LAZYCCD_HD inline double separation_margin(double h) { return 0.5 * h * (1 + 0x1p-20); }

/// Returns an upper bound of |n| during the step. n is quadratic, so it stays in the convex hull of
/// its control vectors.
template <class T>
LAZYCCD_HD inline T longest_normal(const Differences<T>& d, const Magnitudes<T>& m) {
  using S = typename Lane<T>::Scalar;
  const Vec3<T> n0 = cross(d.e1[0], d.e2[0]), n2 = cross(d.e1[1], d.e2[1]);
  const Vec3<T> mixed = cross(d.e1[0], d.e2[1]) + cross(d.e1[1], d.e2[0]);
  const T longest = lane_max(lane_max(dot(n0, n0), dot(n2, n2)), T(S(0.25)) * dot(mixed, mixed));
  return lane_sqrt(longest) + T(8 * Roundoff<S>::u) * (m.n.x + m.n.y + m.n.z);
}

/// Whether the two planes that contain the primitives and are parallel to both stay more than h
/// apart: the non-coplanar filter with |n . r| > h |n|. The margin is twice the bound of f, and
/// 2^14 roundings of h. It keeps single precision, on any backend, less sharp than double
/// precision.
template <class T>
LAZYCCD_HD inline MaskOf<T> planes_apart(const Differences<T>& d, const Magnitudes<T>& m,
                                         const T& h) {
  using S = typename Lane<T>::Scalar;
  Cubic<T> f = coplanarity(d, m);
  f.bound = T(S(2)) * f.bound + T(S(1) + S(0x1p14) * Roundoff<S>::u) * h * longest_normal(d, m);
  return f.no_root();
}

/// Whether the primitives are more than h apart along one of the diagonals x+y, x-y, x+z, x-z, y+z,
/// y-z, at both ends of the step and on the same side.
template <ContactKind kind, class T>
LAZYCCD_HD inline MaskOf<T> separated_along_diagonals(const CoordinatesOf<T>& q, const T& h) {
  using Mask = MaskOf<T>;
  constexpr int split = kind == ContactKind::vertex_face ? 1 : 2;
  constexpr double root2 = 1.4142135623731;  // rounded up
  T Vec3<T>::*const axes[4] = {&Vec3<T>::x, &Vec3<T>::y, &Vec3<T>::z, &Vec3<T>::x};
  const T wide = T(root2) * h, rounding = T(4 * Roundoff<double>::u);
  const Mask none = Mask(h < h), all = Mask(!none);
  Mask separated = none;
  for (int k = 0; k < 3; ++k) {
    Mask above[2] = {all, all}, below[2] = {all, all};  // for the sum and for the difference
    for (int end = 0; end < 2; ++end) {
      const Vec3<T>* p = end ? q.end : q.start;
      for (int i = 0; i < split; ++i) {
        for (int j = split; j < 4; ++j) {
          const T a = p[i].*axes[k] - p[j].*axes[k], b = p[i].*axes[k + 1] - p[j].*axes[k + 1];
          const T threshold = wide + rounding * (lane_abs(a) + lane_abs(b));
          const T sum = a + b, difference = a - b;
          above[0] = Mask(above[0] & (sum > threshold));
          below[0] = Mask(below[0] & (-sum > threshold));
          above[1] = Mask(above[1] & (difference > threshold));
          below[1] = Mask(below[1] & (-difference > threshold));
        }
      }
    }
    separated = Mask(separated | above[0] | below[0] | above[1] | below[1]);
  }
  return separated;
}

/// Returns the time until which, from t on, all corners of one primitive certainly stay more than h
/// away from the other along the axis. Returns t if they are not even so at t, and 2 if they are so
/// to the end of the step.
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
  const T threshold = T(1 + 8 * Roundoff<double>::u) * h * lane_sqrt(dot(axis, axis)) +
                      T(16 * Roundoff<double>::u) * dot(axis_abs, m.r + m.e1 + m.e2) +
                      T(Roundoff<double>::tiny);
  const auto apart = [&](const T& time) {
    Mask all = Mask(lerp(at[0][0], at[1][0], time) > threshold);
    for (int i = 1; i < count; ++i) all = Mask(all & (lerp(at[0][i], at[1][i], time) > threshold));
    return all;
  };
  const Mask now = apart(t), to_the_end = apart(T(1.0));
  T until = T(1.0);
  if (lane_any(Mask(now & !to_the_end))) {
    for (int i = 0; i < count; ++i) {
      const T leaves = (at[0][i] - threshold) / (at[0][i] - at[1][i]);
      until = select(Mask(!Mask(at[1][i] > threshold)), lane_min(until, leaves), until);
    }
    until = until - T(0x1p-20) * (until - t);
    until = select(Mask((until > t) & apart(until)), until, t);
  }
  return select(now, select(to_the_end, T(2.0), until), t);
}

/// The state of a search. The primitives stay apart up to t. The next axis is that of the closest
/// points at the time `ahead`, which is not before t.
template <class T>
struct Search {
  T t = T(0.0), ahead = T(0.0);
  T trust = T(1.0);  // weight of the predicted time at which the distance reaches h, in (0, 1]
};

/// Whether the step from t to next is longer than a quarter of a tick of the time of impact. A
/// shorter step means that the search has arrived.
template <class T>
LAZYCCD_HD inline MaskOf<T> is_beyond(const T& next, const T& t) {
  return next - t > T(0x1p-34);
}

/// The result of one step of a search: apart to the end of the step, or arrived at the contact.
template <class T>
struct Advanced {
  MaskOf<T> missed, arrived;
};

/// Advances the search by one step of conservative advancement (Mirtich 1996). `h` is in the units
/// of d.
///
/// Takes the axis through the closest points at one time, and moves t forward as far as all corners
/// stay apart along that axis. The axis at the time when the distance reaches h is valid for all
/// the time before, so Newton's method predicts that time. If the axis found there does not hold
/// from t on, the axis at t is used next. If that one does not help either, the normal is tried. It
/// is the same axis, but more exact, if the closest points are inside the primitives.
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
  const T closing = -dot(points.gap, gap_moves) / size;  // decrease of the distance per step
  const T reached = select(closing > T(0.0), search.ahead + (size - h) / closing, one);

  const Mask arrived = stuck & !is_ahead;
  search.trust = select(stuck, T(0.5) * search.trust, search.trust);
  search.t = select(arrived, t, next);
  T ahead = next + search.trust * (reached - next);
  ahead = select(ahead < one, ahead, one);
  search.ahead = select(Mask(Mask(!stuck) & is_beyond(ahead, next)), ahead, next);
  return {next > one, arrived};
}

constexpr int kMaxAdvances = 4096;  ///< more steps than this count as arrived

/// Returns a time as Contact::toi in ticks.
LAZYCCD_HD inline std::int64_t approach_tick(double t) {
  return static_cast<std::int64_t>(lane_floor(t * 4294967296.0));
}

/// The whole test; `scale` is the `power` of differences().
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
