// The usual query, decided at the roots of its cubic: bracket each root between times where the sign of
// f is certain, then look at the inside conditions there. What stays uncertain is left undecided.
#pragma once

#include "core/elementary.h"

namespace lazyccd {

// At most one of hit and miss is set; neither: undecided. On a hit, f has exactly one root in
// [lo, hi], the first contact of the query.
template <class T>
struct Verdict {
  MaskOf<T> hit, miss;
  T lo, hi;
};

// Newton's method on [a, b], with bisection where it would leave the bracket (Press et al., rtsafe).
// sign * f is positive at a and negative at b. The result is an estimate: nothing relies on it.
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

// Where the cubic, positive and falling at 0 and positive at 1, turns: the local minimum of f.
template <class T>
LAZYCCD_HD inline T estimate_minimum(const Cubic<T>& f, const T& sign) {
  using S = typename Lane<T>::Scalar;
  const T c = sign * (f.k[1] - f.k[0]);
  const T b = sign * (f.k[2] - f.k[1]) - c;
  const T a = sign * (f.k[3] - f.k[2]) - c - b - b;
  return estimated_quotient(T(-c), T(b + lane_sqrt(lane_max(b * b - a * c, T(S(0))))));
}

// The grid on which roots are bracketed: wide enough for certain signs in the precision of T, narrow
// enough for the inside conditions to hardly change over two cells.
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

// One root of f in [a, b] (ends on the grid), where sign * f goes from positive to negative.
template <ContactKind kind, class T>
LAZYCCD_HD inline Verdict<T> decide_at_root(const Differences<T>& d, const Magnitudes<T>& m,
                                            const Cubic<T>& f, const T& sign, const T& a, const T& b) {
  using S = typename Lane<T>::Scalar;
  const T cells = T(RootGrid<S>::cells), cell = T(S(1) / RootGrid<S>::cells);
  const T x = estimate_root(f, sign, a, b, RootGrid<S>::iterations);
  const T below = lane_floor(x * cells - T(S(0.5))) * cell;
  const T lo = lane_max(a, below), hi = lane_min(b, below + cell + cell);
  const MaskOf<T> bracketed = MaskOf<T>((sign * f.at(lo) > f.bound) & (sign * f.at(hi) < -f.bound));
  const T half = T(S(0.5)) * (hi - lo);
  const Inside<T> inside = inside_conditions<kind>(d, m, lo + half, half);
  return {MaskOf<T>(bracketed & inside.all_positive), MaskOf<T>(bracketed & inside.any_negative), lo, hi};
}

template <ContactKind kind, class T>
LAZYCCD_HD inline Verdict<T> decide_at_roots(const Differences<T>& d, const Magnitudes<T>& m,
                                             const Cubic<T>& f) {
  using S = typename Lane<T>::Scalar;
  using Mask = MaskOf<T>;
  const T zero = T(S(0)), half = T(S(0.5)), one = T(S(1)), cells = T(RootGrid<S>::cells);
  const T sign = select(f.k[0] < zero, T(S(-1)), one);
  const T k0 = sign * f.k[0], k1 = sign * f.k[1], k2 = sign * f.k[2], k3 = sign * f.k[3];
  const Mask starts = k0 > f.bound;
  // By Descartes' rule one change of sign among the coefficients is one root.
  const Mask falls = Mask(starts & (k3 < -f.bound));
  const Mask one_root = Mask(falls & ((k1 > f.bound) | (k2 < -f.bound)));

  // Otherwise the first turn of the cubic, a minimum, parts its roots. Both ends on one side: two roots
  // where the minimum is certainly on the other side, none where no part has one. Ends on two sides: a
  // minimum below has one root before it and perhaps two behind, one above has one root behind it.
  Mask miss = f.no_root();
  const Mask same_side = Mask(starts & (k3 > f.bound) & !miss), winding = Mask(falls & !one_root);
  const Mask none = Mask(same_side & !same_side);
  Mask two_roots = none, root_before = none, none_after = none, root_after = none;
  T turn = one;
  if (lane_any(Mask(same_side | winding))) {
    const T at = lane_floor(estimate_minimum(f, sign) * cells + T(S(0.5))) / cells;
    const Mask turns = Mask((same_side | winding) & (at > zero) & (at < one));
    turn = select(turns, at, one);
    const T minimum = sign * f.at(turn);
    const Mask below = Mask(turns & (minimum < -f.bound)), above = Mask(turns & (minimum > f.bound));
    // Each side of the turn in halves: where f is steep at an end, the whole side's coefficients
    // overshoot.
    const T before = half * turn, after = before + half;
    const Mask none_before = Mask(f.on(zero, before).no_root() & f.on(before, turn).no_root());
    none_after = Mask(f.on(turn, after).no_root() & f.on(after, one).no_root());
    two_roots = Mask(same_side & below);
    root_before = Mask(winding & below & (sign * f.on(zero, turn).k[2] < -f.bound));
    root_after = Mask(winding & above & none_before & (sign * f.on(turn, one).k[1] > f.bound));
    miss = Mask(miss | (same_side & turns & none_before & none_after));
  }

  const Mask rooted = Mask(one_root | two_roots | root_before | root_after);
  Verdict<T> first = decide_at_root<kind>(d, m, f, sign, select(root_after, turn, zero),
                                          select(root_after, one, turn));
  first.hit = Mask(first.hit & rooted);
  miss = Mask(miss | (first.miss & (one_root | root_after | (root_before & none_after))));
  const Mask later = Mask(first.miss & two_roots);
  if (lane_any(later)) {
    const Verdict<T> second = decide_at_root<kind>(d, m, f, -sign, turn, one);
    miss = Mask(miss | (later & second.miss));
    first.lo = select(later, second.lo, first.lo);
    first.hi = select(later, second.hi, first.hi);
    first.hit = Mask(first.hit | (later & second.hit));
  }
  first.miss = miss;
  return first;
}

}  // namespace lazyccd
