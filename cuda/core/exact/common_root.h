// Multiple roots of a polynomial and common roots of two, by determinants of fixed size.
#pragma once

#include "core/exact/polynomial.h"

namespace lazyccd::exact {

/// Whether a trimmed polynomial has a multiple root: its discriminant is zero.
template <class Integer>
LAZYCCD_HD LAZYCCD_CALLED bool has_multiple_root(const Poly<Integer>& p) {
  const Integer* c = p.c;
  if (p.degree < 2) return false;
  if (p.degree == 2) return Integer::dot({c[1], c[0] << 2}, {c[1], c[2]}, 0b10).sign() == 0;
  // 18 dcba - 4 c^3 a + c^2 b^2 - 4 d b^3 - 27 d^2 a^2, for a + bx + cx^2 + dx^3.
  const Integer bc = c[1] * c[2], da = c[3] * c[0];
  const Integer sum = Integer::dot({Integer::dot({da, bc}, {Integer(18), Integer(1)}),
                                    (c[2] * c[2]) << 2, (c[1] * c[1]) << 2, da * da},
                                   {bc, c[2] * c[0], c[3] * c[1], Integer(27)}, 0b1110);
  return sum.sign() == 0;
}

/// The roots of a polynomial with a multiple root. All are rational, so each is the root of a
/// linear polynomial.
template <class Integer>
struct RationalRoots {
  int count;              // of different roots
  Poly<Integer> root[2];  // in any order
  bool first_is_smaller;
};

/// p: trimmed, with has_multiple_root().
template <class Integer>
LAZYCCD_HD LAZYCCD_CALLED RationalRoots<Integer> rational_roots(const Poly<Integer>& p) {
  using P = Poly<Integer>;
  const Integer *c = p.c, zero(0);
  if (p.degree == 2) {
    const P root = P::linear(c[1], c[2] + c[2]);
    return {1, {root, root}, true};
  }
  const Integer three(3), nine(9), spread = Integer::dot({c[2], c[3] * c[1]}, {c[2], three}, 0b10);
  if (spread.sign() == 0) {
    const P root = P::linear(c[2], c[3] * three);
    return {1, {root, root}, true};
  }
  const Integer numerator = Integer::dot({c[3] * c[0], c[2]}, {nine, c[1]}, 0b10),
                denominator = spread << 1;
  const P twice = P::linear(zero - numerator, denominator);
  const P once = P::linear(Integer::dot({c[2] * c[2], c[3] * c[3] * nine, (c[3] * c[2]) << 2},
                                        {c[2], c[0], c[1]}, 0b100),
                           c[3] * spread);
  // The second derivative at the double root d is 2 c3 (d - s), where s is the simple one.
  const Integer curvature = Integer::dot({numerator, denominator}, {c[3] * three, c[2]});
  const int above = curvature.sign() * denominator.sign() * c[3].sign();
  return {2, {twice, once}, above < 0};
}

/// How two trimmed polynomials share roots.
template <class Integer>
struct CommonRoots {
  enum Kind { none, of_linear, all_of_p } kind;
  Poly<Integer> linear;  // of_linear: the common root is its root
};

/// f: of degree 1 to 3. p: of degree 1 or 2.
template <class Integer>
LAZYCCD_HD LAZYCCD_CALLED CommonRoots<Integer> common_roots(const Poly<Integer>& f,
                                                            const Poly<Integer>& p) {
  using P = Poly<Integer>;
  using Common = CommonRoots<Integer>;
  const Integer *a = f.c, *b = p.c, zero(0);
  if (p.degree == 1) {
    // f at -b0 / b1, times b1^3.
    const Integer x = zero - b[0], w = b[1], xx = x * x, ww = w * w;
    const Integer value = Integer::dot({a[0] * w, a[1] * x, a[2] * w, a[3] * x}, {ww, ww, xx, xx});
    return value.sign() != 0 ? Common{Common::none, p} : Common{Common::of_linear, p};
  }
  // The resultant as a determinant, by Bezout: rows p, (a3 x) p - b2 f, (a3 x + a2) x p - (b2 x +
  // b1) f, each with the coefficients of x^2, x, 1. It works for f of lower degree, too.
  const auto minor = [](const Integer& x, const Integer& y, const Integer& u, const Integer& v) {
    return Integer::dot({x, u}, {y, v}, 0b10);
  };
  const Integer h0 = minor(a[3], b[1], a[2], b[2]), h1 = minor(a[3], b[0], a[1], b[2]),
                h2 = zero - a[0] * b[2];
  const Integer g0 = h1, g1 = Integer::dot({a[2], a[0], a[1]}, {b[0], b[2], b[1]}, 0b110),
                g2 = zero - a[0] * b[1];
  const Integer resultant =
      Integer::dot({minor(h1, g2, h2, g1), minor(h0, g2, h2, g0), minor(h0, g1, h1, g0)},
                   {b[2], b[1], b[0]}, 0b010);
  if (resultant.sign() != 0) return {Common::none, p};
  // The remainder of b2^2 f divided by p.
  const Integer q = minor(a[2], b[2], a[3], b[1]), square = b[2] * b[2];
  const P rest = P::linear(minor(square, a[0], q, b[0]),
                           Integer::dot({square, b[2] * b[0], q}, {a[1], a[3], b[1]}, 0b110));
  if (rest.is_zero()) return {Common::all_of_p, p};
  return {Common::of_linear, rest};
}

}  // namespace lazyccd::exact
