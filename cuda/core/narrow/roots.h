// Decides the usual query at the roots of its cubic f. Brackets each root between two times at
// which the sign of f is certain, then checks the inside conditions there. What remains uncertain
// is left undecided.
#pragma once

#include "core/narrow/elementary.h"

namespace lazyccd {

/// The result for a query. At most one of hit and miss is set; neither means undecided. On a hit, f
/// has exactly one root in [lo, hi], and it is the first contact of the query.
template <class T>
struct Verdict {
  MaskOf<T> hit, miss;
  T lo, hi;
};

/// Estimates the root in [a, b] by Newton's method, with bisection where a step would leave the
/// bracket (Press et al., rtsafe). sign * f is positive at a and negative at b. Nothing certified
/// relies on the result.
template <class T>
LAZYCCD_HD inline T estimate_root(const Cubic<T>& f, const T& sign, T a, T b, int iterations) {
  using S = typename Lane<T>::Scalar;
  const T c0 = sign * f.k[0], c1 = sign * (T(S(3)) * (f.k[1] - f.k[0]));
  const T c2 = sign * (T(S(3)) * (f.k[0] - f.k[1] - f.k[1] + f.k[2]));
  const T c3 = sign * (f.k[3] - f.k[0] + T(S(3)) * (f.k[1] - f.k[2]));
  const T fa = ((c3 * a + c2) * a + c1) * a + c0, fb = ((c3 * b + c2) * b + c1) * b + c0;
  T x = a + (b - a) * estimated_quotient(fa, T(fa - fb));
  LAZYCCD_ONE_COPY
  for (int i = 0; i < iterations; ++i) {
    const T value = ((c3 * x + c2) * x + c1) * x + c0;
    const T slope = (T(S(3)) * c3 * x + T(S(2)) * c2) * x + c1;
    const MaskOf<T> before = value > T(S(0));
    a = select(before, x, a);
    b = select(before, b, x);
    const T newton = x - estimated_quotient(value, slope);
    x = select(MaskOf<T>((newton >= a) & (newton <= b)), newton, T(S(0.5)) * (a + b));
  }
  return x;
}

/// Estimates the time of the local minimum of sign * f, if that is positive and falling at 0.
template <class T>
LAZYCCD_HD inline T estimate_minimum(const Cubic<T>& f, const T& sign) {
  using S = typename Lane<T>::Scalar;
  const T c = sign * (f.k[1] - f.k[0]);
  const T b = sign * (f.k[2] - f.k[1]) - c;
  const T a = sign * (f.k[3] - f.k[2]) - c - b - b;
  return estimated_quotient(T(-c), T(b + lane_sqrt(lane_max(b * b - a * c, T(S(0))))));
}

/// The grid on which roots are bracketed. Its cells are wide enough for certain signs in the
/// precision of T, and narrow enough that the inside conditions hardly change over two cells.
template <class S>
struct RootGrid;
template <>
struct RootGrid<float> {
  static constexpr float cells = 4096;
  static constexpr int iterations = 5;
};
template <>
struct RootGrid<double> {
  static constexpr double cells = 1 << 24;
  static constexpr int iterations = 8;
};

/// Decides the query at the one root of f in [a, b], whose ends are on the grid. sign * f goes from
/// positive to negative there.
template <ContactKind kind, class T>
LAZYCCD_HD inline Verdict<T> decide_at_root(const Differences<T>& d, const Magnitudes<T>& m,
                                            const Cubic<T>& f, const T& sign, const T& a,
                                            const T& b) {
  using S = typename Lane<T>::Scalar;
  const T cells = T(RootGrid<S>::cells), cell = T(S(1) / RootGrid<S>::cells);
  const T x = estimate_root(f, sign, a, b, RootGrid<S>::iterations);
  const T below = lane_floor(x * cells - T(S(0.5))) * cell;
  const T lo = lane_max(a, below), hi = lane_min(b, below + cell + cell);
  const MaskOf<T> bracketed = MaskOf<T>((sign * f.at(lo) > f.bound) & (sign * f.at(hi) < -f.bound));
  const T half = T(S(0.5)) * (hi - lo);
  const Inside<T> inside = inside_conditions<kind>(d, m, lo + half, half);
  return {MaskOf<T>(bracketed & inside.all_positive), MaskOf<T>(bracketed & inside.any_negative),
          lo, hi};
}

/// Decides the query at all roots of f, as far as certain signs allow.
template <ContactKind kind, class T>
LAZYCCD_HD inline Verdict<T> decide_at_roots(const Differences<T>& d, const Magnitudes<T>& m,
                                             const Cubic<T>& f) {
  using S = typename Lane<T>::Scalar;
  using Mask = MaskOf<T>;
  const T zero = T(S(0)), half = T(S(0.5)), one = T(S(1)), cells = T(RootGrid<S>::cells);
  const T sign = select(f.k[0] < zero, T(S(-1)), one);
  const T k0 = sign * f.k[0], k1 = sign * f.k[1], k2 = sign * f.k[2], k3 = sign * f.k[3];
  const Mask certain_start = k0 > f.bound;
  // Descartes' rule: one change of sign among the coefficients means one root.
  const Mask sign_change = Mask(certain_start & (k3 < -f.bound));
  const Mask one_root = Mask(sign_change & ((k1 > f.bound) | (k2 < -f.bound)));

  // Otherwise the local minimum of sign * f, at t_min, separates the roots.
  //   Both ends positive: two roots if the minimum is certainly negative; none if no part has one.
  //   Ends of different sign: one root before a negative minimum and perhaps two after it; one root
  //   after a positive minimum.
  Mask miss = f.no_root();
  const Mask same_side = Mask(certain_start & (k3 > f.bound) & !miss),
             opposite_sides = Mask(sign_change & !one_root);
  const Mask none = Mask(same_side & !same_side);
  Mask two_roots = none, root_before = none, none_after = none, root_after = none;
  T t_min = one;
  if (lane_any(Mask(same_side | opposite_sides))) {
    const T at = lane_floor(estimate_minimum(f, sign) * cells + T(S(0.5))) / cells;
    const Mask has_minimum = Mask((same_side | opposite_sides) & (at > zero) & (at < one));
    t_min = select(has_minimum, at, one);
    const T minimum = sign * f.at(t_min);
    const Mask below = Mask(has_minimum & (minimum < -f.bound)),
               above = Mask(has_minimum & (minimum > f.bound));
    // Each side of the minimum is checked in halves: if f is steep at an end, the coefficients of
    // the whole side overshoot.
    const T before = half * t_min, after = before + half;
    const Mask none_before = Mask(f.on(zero, before).no_root() & f.on(before, t_min).no_root());
    none_after = Mask(f.on(t_min, after).no_root() & f.on(after, one).no_root());
    two_roots = Mask(same_side & below);
    root_before = Mask(opposite_sides & below & (sign * f.on(zero, t_min).k[2] < -f.bound));
    root_after =
        Mask(opposite_sides & above & none_before & (sign * f.on(t_min, one).k[1] > f.bound));
    miss = Mask(miss | (same_side & has_minimum & none_before & none_after));
  }

  const Mask rooted = Mask(one_root | two_roots | root_before | root_after);
  Verdict<T> first = decide_at_root<kind>(d, m, f, sign, select(root_after, t_min, zero),
                                          select(root_after, one, t_min));
  first.hit = Mask(first.hit & rooted);
  miss = Mask(miss | (first.miss & (one_root | root_after | (root_before & none_after))));
  const Mask later = Mask(first.miss & two_roots);
  if (lane_any(later)) {
    const Verdict<T> second = decide_at_root<kind>(d, m, f, -sign, t_min, one);
    miss = Mask(miss | (later & second.miss));
    first.lo = select(later, second.lo, first.lo);
    first.hi = select(later, second.hi, first.hi);
    first.hit = Mask(first.hit | (later & second.hit));
  }
  first.miss = miss;
  return first;
}

}  // namespace lazyccd
