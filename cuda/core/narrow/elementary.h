// The elementary tests: building blocks that decide one query with certified signs, for one number
// or for several lanes at once.
//
// A query is two primitives whose points move linearly over t in [0, 1]. Both kinds reduce to three
// position differences, each linear in t:
//   vertex-face, p against (a, b, c):
//     e1 = b - a, e2 = c - a, r = p - a;  contact if r = u e1 + v e2
//   edge-edge, (a, b) against (c, d):
//     e1 = b - a, e2 = d - c, r = c - a;  contact if r = u e1 - v e2
// Let n = e1 x e2. The four points are coplanar when the cubic f = n . r is zero (Provot 1997). At
// such a time the primitives touch if all inside conditions hold:
//   vertex-face  u n.n = n.(r x e2), v n.n = n.(e1 x r);   u, v, 1 - u - v >= 0
//   edge-edge    u n.n = n.(r x e2), v n.n = n.(r x e1);   u, 1 - u, v, 1 - v >= 0
//
// Certified signs. Every computed quantity comes with a bound on its rounding error. Its sign is
// certain if its magnitude exceeds the bound. A query is a hit or a miss only by certain signs;
// otherwise it stays undecided and goes on to double precision or to exact arithmetic.
//
// Rounding. The inputs are the differences in double, scaled by a power of two to at most 2^6 and
// rounded to T. So each component has a relative error of at most u, where u = 2^-24 or 2^-53.
// Roundoff::tiny covers underflow. In the table below,
//   E1, E2, R  hold the largest magnitude of each component over both ends of the step;
//   D          holds the magnitude of each component of an axis;
//   N = cross_bound(E1, E2), W = cross_bound(R, E1 or E2), NR = N . R, NN = N . N, NW = N . W.
// The table counts the roundings to first order. Terms of second order, and the rounding of the
// bound itself, are below 2^-20 of the bound; the slack of the last column covers them.
//
// The last column is the bound that the code uses and, if another file uses it, the name of the
// file; empty: an intermediate quantity.
//
//   quantity                                        counted                      used
//   component of e x e                              4 u N
//   f's coefficients k0, k3 = n.r at the ends       4 + 2 + 2            =  8 u
//   k1, k2 = (m.r + n.r') / 3, m = mixed cross      (18 + 8 + 3) / 3 + 2 = 11.7 u
//   ... on a subinterval (three lerps, 2 u each)    11.7 + 6             = 17.7 u  20 u NR
//   e, r at a time (one lerp)                       1 + 2                =  3 u
//   n, r x e at a time                              2 * 3 + 2            =  8 u
//   n.(r x e) at a time                             2 * 8 + 3            = 19 u
//   n.n minus one or two of those                   19 + 2               = 21 u
//   ... with the rounded ends in its derivative     21 + 4               = 25 u    30 u (NN + NW)
//   corner difference . axis at a time              4 + 3 + 2            =  9 u    16 u D.(R+E1+E2)
//                                                               subdivision.h, separation.h
//
// A comparison with NaN is false, so an overflow can only leave a query undecided.
#pragma once

#include "core/lane.h"
#include "core/vec.h"
#include "lazyccd/contact.h"

namespace lazyccd {

/// The position differences of a query at both ends of the step, scaled so that every component is
/// at most 2^6.
template <class T>
struct Differences {
  Vec3<T> e1[2], e2[2], r[2];
};

/// The largest magnitude of each component over the step, and the bound on n that follows.
template <class T>
struct Magnitudes {
  Vec3<T> e1, e2, r;  // E1, E2, R
  Vec3<T> n;          // N: bounds each component of e1 x e2
};

/// The largest magnitude of each component over both ends.
template <class T>
LAZYCCD_HD inline Vec3<T> max_abs(const Vec3<T> (&v)[2]) {
  return {max_abs(v[0].x, v[1].x), max_abs(v[0].y, v[1].y), max_abs(v[0].z, v[1].z)};
}

/// The magnitude by which each component changes over the step, rounded. inside_conditions() allows
/// for the rounding.
template <class T>
LAZYCCD_HD inline Vec3<T> rounded_change(const Vec3<T> (&v)[2]) {
  return {lane_abs(v[1].x - v[0].x), lane_abs(v[1].y - v[0].y), lane_abs(v[1].z - v[0].z)};
}

template <class T>
LAZYCCD_HD inline Magnitudes<T> magnitudes(const Differences<T>& d) {
  Magnitudes<T> m{max_abs(d.e1), max_abs(d.e2), max_abs(d.r), {}};
  m.n = cross_bound(m.e1, m.e2);
  return m;
}

template <class T>
LAZYCCD_HD inline T lerp(const T& a, const T& b, const T& t) {
  return (T(1) - t) * a + t * b;
}

template <class T>
LAZYCCD_HD inline Vec3<T> lerp(const Vec3<T> (&v)[2], const T& t) {
  return {lerp(v[0].x, v[1].x, t), lerp(v[0].y, v[1].y, t), lerp(v[0].z, v[1].z, t)};
}

/// A cubic in Bernstein form over [0, 1]. `bound` covers the error of its coefficients, and of the
/// coefficients on any subinterval whose ends T represents exactly.
template <class T>
struct Cubic {
  T k[4];
  T bound;

  LAZYCCD_HD T at(const T& t) const {
    const T a = lerp(k[0], k[1], t), b = lerp(k[1], k[2], t), c = lerp(k[2], k[3], t);
    return lerp(lerp(a, b, t), lerp(b, c, t), t);
  }

  /// The same cubic over [lo, hi]: the blossom at (lo,lo,lo), (lo,lo,hi), (lo,hi,hi), (hi,hi,hi).
  LAZYCCD_HD Cubic on(const T& lo, const T& hi) const {
    const T a = lerp(k[0], k[1], lo), b = lerp(k[1], k[2], lo), c = lerp(k[2], k[3], lo);
    const T d = lerp(k[0], k[1], hi), e = lerp(k[1], k[2], hi), f = lerp(k[2], k[3], hi);
    const T ab = lerp(a, b, lo), bc = lerp(b, c, lo), de = lerp(d, e, hi), ef = lerp(e, f, hi);
    return {{lerp(ab, bc, lo), lerp(ab, bc, hi), lerp(de, ef, lo), lerp(de, ef, hi)}, bound};
  }

  LAZYCCD_HD MaskOf<T> all_positive() const {
    return (k[0] > bound) & (k[1] > bound) & (k[2] > bound) & (k[3] > bound);
  }
  LAZYCCD_HD MaskOf<T> all_negative() const {
    return (k[0] < -bound) & (k[1] < -bound) & (k[2] < -bound) & (k[3] < -bound);
  }
  /// The non-coplanar filter (Tang et al. 2010, who call it the non-penetration filter): whether
  /// the cubic certainly has no root.
  LAZYCCD_HD MaskOf<T> no_root() const { return all_positive() | all_negative(); }
};

/// Returns the cubic f = (e1 x e2) . r, with its error bound.
template <class T>
LAZYCCD_HD inline Cubic<T> coplanarity(const Differences<T>& d, const Magnitudes<T>& m) {
  using S = typename Lane<T>::Scalar;
  const Vec3<T> n0 = cross(d.e1[0], d.e2[0]);
  const Vec3<T> n2 = cross(d.e1[1], d.e2[1]);
  const Vec3<T> mixed = cross(d.e1[0], d.e2[1]) + cross(d.e1[1], d.e2[0]);
  const T third = T(S(1) / S(3));
  Cubic<T> f;
  f.k[0] = dot(n0, d.r[0]);
  f.k[1] = (dot(mixed, d.r[0]) + dot(n0, d.r[1])) * third;
  f.k[2] = (dot(n2, d.r[0]) + dot(mixed, d.r[1])) * third;
  f.k[3] = dot(n2, d.r[1]);
  f.bound = T(20 * Roundoff<S>::u) * dot(m.n, m.r) + T(Roundoff<S>::tiny);
  return f;
}

/// Signs of the inside conditions that hold for all t in [mid - half, mid + half].
template <class T>
struct Inside {
  MaskOf<T> all_positive;  // every condition is certainly positive: inside, and n is not zero
  /// A condition is certainly negative: no contact. This includes times at which n is zero, because
  /// every condition would be zero then.
  MaskOf<T> any_negative;
};

/// Evaluates the inside conditions on [mid - half, mid + half]. Each condition g is a product of
/// two quadratics, like n.n, whose derivatives are bounded over the whole step. So g stays within
/// half * max|g'| of its value at mid (mean value theorem).
template <ContactKind kind, class T>
LAZYCCD_HD inline Inside<T> inside_conditions(const Differences<T>& d, const Magnitudes<T>& m,
                                              const T& mid, const T& half) {
  using S = typename Lane<T>::Scalar;
  const Vec3<T> e1 = lerp(d.e1, mid), e2 = lerp(d.e2, mid), r = lerp(d.r, mid);
  const Vec3<T> n = cross(e1, e2);
  const Vec3<T> wu = cross(r, e2);
  const Vec3<T> wv = kind == ContactKind::vertex_face ? cross(e1, r) : cross(r, e1);
  const T gu = dot(n, wu), gv = dot(n, wv), nn = dot(n, n);

  const Vec3<T> wu_bound = cross_bound(m.r, m.e2), wv_bound = cross_bound(m.r, m.e1);
  const Vec3<T> de1 = rounded_change(d.e1), de2 = rounded_change(d.e2), dr = rounded_change(d.r);
  const Vec3<T> dn = cross_bound(de1, m.e2) + cross_bound(m.e1, de2);
  const Vec3<T> dwu = cross_bound(dr, m.e2) + cross_bound(m.r, de2);
  const Vec3<T> dwv = cross_bound(dr, m.e1) + cross_bound(m.r, de1);

  const T rounding = T(30 * Roundoff<S>::u);
  const T spread = half * T(S(1.001));  // the extra thousandth covers its own rounding
  const T tiny = T(Roundoff<S>::tiny);
  const T err_n = spread * (T(2) * dot(m.n, dn)) + rounding * dot(m.n, m.n) + tiny;
  const T err_u =
      spread * (dot(dn, wu_bound) + dot(m.n, dwu)) + rounding * dot(m.n, wu_bound) + tiny;
  const T err_v =
      spread * (dot(dn, wv_bound) + dot(m.n, dwv)) + rounding * dot(m.n, wv_bound) + tiny;

  using Mask = MaskOf<T>;
  if constexpr (kind == ContactKind::vertex_face) {
    const T gw = nn - gu - gv, err_w = err_n + err_u + err_v;
    return {Mask((gu > err_u) & (gv > err_v) & (gw > err_w)),
            Mask((gu < -err_u) | (gv < -err_v) | (gw < -err_w))};
  } else {
    const T hu = nn - gu, hv = nn - gv, err_hu = err_n + err_u, err_hv = err_n + err_v;
    return {Mask((gu > err_u) & (hu > err_hu) & (gv > err_v) & (hv > err_hv)),
            Mask((gu < -err_u) | (hu < -err_hu) | (gv < -err_v) | (hv < -err_hv))};
  }
}

}  // namespace lazyccd
