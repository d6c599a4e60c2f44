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
template <ContactKind kind>
LAZYCCD_HD inline bool separated_along_diagonals(const QueryCoordinates& q, double h) {
  constexpr int split = kind == ContactKind::vertex_face ? 1 : 2;
  constexpr double root2 = 1.4142135623731;  // from above
  const double Vec3<double>::*const axes[4] = {&Vec3<double>::x, &Vec3<double>::y, &Vec3<double>::z,
                                               &Vec3<double>::x};
  for (int k = 0; k < 3; ++k) {
    bool above[2] = {true, true}, below[2] = {true, true};  // of the sum and of the difference
    for (int end = 0; end < 2; ++end) {
      const Vec3<double>* p = end ? q.end : q.start;
      for (int i = 0; i < split; ++i) {
        for (int j = split; j < 4; ++j) {
          const double a = p[i].*axes[k] - p[j].*axes[k], b = p[i].*axes[k + 1] - p[j].*axes[k + 1];
          const double least = root2 * h + 4 * Roundoff<double>::u * (lane_abs(a) + lane_abs(b));
          above[0] = above[0] && a + b > least;
          below[0] = below[0] && -(a + b) > least;
          above[1] = above[1] && a - b > least;
          below[1] = below[1] && b - a > least;
        }
      }
    }
    if (above[0] || below[0] || above[1] || below[1]) return true;
  }
  return false;
}

// From t, when until? Up to then all corners of one primitive certainly stay more than h from the
// other along the axis; t itself where not even then, 2 where they do to the end of the step.
template <ContactKind kind>
LAZYCCD_HD inline double apart_until(const Differences<double>& d, const Magnitudes<double>& m,
                                     const Vec3<double>& axis, double h, double t) {
  constexpr int count = 4;
  double at[2][count];  // the corners at both ends
  for (int end = 0; end < 2; ++end) {
    const double r = dot(axis, d.r[end]), e1 = dot(axis, d.e1[end]), e2 = dot(axis, d.e2[end]);
    at[end][0] = r;
    at[end][1] = r - e1;
    at[end][2] = kind == ContactKind::vertex_face ? r - e2 : r + e2;
    at[end][3] = kind == ContactKind::vertex_face ? r : r + e2 - e1;
  }
  const Vec3<double> axis_abs{lane_abs(axis.x), lane_abs(axis.y), lane_abs(axis.z)};
  const double least = (1 + 8 * Roundoff<double>::u) * h * lane_sqrt(dot(axis, axis)) +
                       16 * Roundoff<double>::u * dot(axis_abs, m.r + m.e1 + m.e2) +
                       Roundoff<double>::tiny;
  const auto apart = [&](double time) {
    bool all = true;
    for (int i = 0; i < count; ++i) all = all && lerp(at[0][i], at[1][i], time) > least;
    return all;
  };
  if (!apart(t)) return t;
  if (apart(1)) return 2;
  double until = 1;
  for (int i = 0; i < count; ++i)
    if (!(at[1][i] > least)) until = lane_min(until, (at[0][i] - least) / (at[0][i] - at[1][i]));
  until -= 0x1p-20 * (until - t);
  return until > t && apart(until) ? until : t;
}

constexpr int kMaxAdvances = 4096;

// Conservative advancement (Mirtich 1996) along the axis through the closest points of the moment,
// as far as all corners stay apart along it; or along the normal, which is the same axis, and more
// exact, where the points lie inside. h in the units of d.
template <ContactKind kind>
LAZYCCD_HD inline Decision decide_within(const Differences<double>& d, double h) {
  const Magnitudes<double> m = magnitudes(d);
  if (planes_apart(d, m, h)) return {Decision::miss, 0};
  double t = 0;
  for (int advance = 0; advance < kMaxAdvances; ++advance) {
    const Vec3<double> e1 = lerp(d.e1, t), e2 = lerp(d.e2, t), r = lerp(d.r, t);
    double next = apart_until<kind>(d, m, closest_points<kind>(e1, e2, r).gap, h, t);
    if (!(next - t > 0x1p-34)) {
      const Vec3<double> n = cross(e1, e2);
      next = apart_until<kind>(d, m, dot(n, r) < 0 ? -1.0 * n : n, h, t);
    }
    if (next > 1) return {Decision::miss, 0};
    if (!(next - t > 0x1p-34)) break;
    t = next;
  }
  return {Decision::hit, static_cast<std::int64_t>(lane_floor(t * 4294967296.0))};
}

// As above, from the points; `scale` as for differences().
template <ContactKind kind>
LAZYCCD_HD inline Decision decide_within(const QueryCoordinates& q, double h, double scale) {
  if (separated_along_axes<kind>(q, h) || separated_along_diagonals<kind>(q, h))
    return {Decision::miss, 0};
  return decide_within<kind>(differences<kind>(q, scale), h * scale);
}

}  // namespace lazyccd
