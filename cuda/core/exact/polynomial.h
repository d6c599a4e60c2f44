// Polynomials in time over one step, of degree 3 at most, with integer coefficients.
//
// The code of this folder is for the host and the device. Integer is FixedInteger, or another type
// with the same operations, such as one with a limb in each lane of a warp.
#pragma once

#include "core/platform.h"

/// On the device, keeps a function of long code from being copied into its callers.
#if defined(__CUDA_ARCH__)
#define LAZYCCD_CALLED __noinline__
#else
#define LAZYCCD_CALLED
#endif

namespace lazyccd::exact {

/// p(t) = sum_i c[i] t^i (1-t)^(degree-i), t in [0, 1]. With x = t / (1-t) it has the roots of
/// sum_i c[i] x^i; see Polynomial in cpu/narrow/polynomial.h for why.
template <class Integer>
struct Poly {
  int degree;
  Integer c[4];

  LAZYCCD_HD static Poly linear(const Integer& at_start, const Integer& at_end) {
    return {1, {at_start, at_end, Integer(0), Integer(0)}};
  }

  LAZYCCD_HD LAZYCCD_CALLED bool is_zero() const {
    for (int i = 0; i <= degree; ++i)
      if (c[i].sign() != 0) return false;
    return true;
  }
  LAZYCCD_HD LAZYCCD_CALLED int sign_changes() const {
    int changes = 0, last = 0;
    for (int i = 0; i <= degree; ++i) {
      const int sign = c[i].sign();
      if (sign != 0 && last != 0 && sign != last) ++changes;
      if (sign != 0) last = sign;
    }
    return changes;
  }
  /// Sign of p just after the start.
  LAZYCCD_HD LAZYCCD_CALLED int first_sign() const {
    for (int i = 0; i <= degree; ++i)
      if (const int sign = c[i].sign()) return sign;
    return 0;
  }

  /// A positive multiple of p over the later half of the interval, mapped to [0, 1].
  LAZYCCD_HD LAZYCCD_CALLED void take_later_half() {
    for (int i = 0; i < degree; ++i)
      for (int j = degree - 1; j >= i; --j) c[j] = c[j] + c[j + 1];
    for (int i = 1; i <= degree; ++i) c[i] = c[i] << i;
  }
  LAZYCCD_HD LAZYCCD_CALLED void take_earlier_half() {
    for (int i = degree; i > 0; --i)
      for (int j = 1; j <= i; ++j) c[j] = c[j] + c[j - 1];
    for (int i = 0; i < degree; ++i) c[i] = c[i] << (degree - i);
  }

  /// The same without factors t and 1-t: with the same roots inside (0, 1).
  LAZYCCD_HD LAZYCCD_CALLED Poly trimmed() const {
    int first = 0, last = degree;
    while (last > 0 && c[last].sign() == 0) --last;
    while (first < last && c[first].sign() == 0) ++first;
    Poly p{last - first, {Integer(0), Integer(0), Integer(0), Integer(0)}};
    for (int i = first; i <= last; ++i) p.c[i - first] = c[i];
    return p;
  }
};

/// Both of the same degree.
template <class Integer>
LAZYCCD_HD LAZYCCD_CALLED Poly<Integer> operator+(Poly<Integer> p, const Poly<Integer>& q) {
  for (int i = 0; i <= p.degree; ++i) p.c[i] = p.c[i] + q.c[i];
  return p;
}
template <class Integer>
LAZYCCD_HD LAZYCCD_CALLED Poly<Integer> operator-(Poly<Integer> p, const Poly<Integer>& q) {
  for (int i = 0; i <= p.degree; ++i) p.c[i] = p.c[i] - q.c[i];
  return p;
}
template <class Integer>
LAZYCCD_HD LAZYCCD_CALLED Poly<Integer> operator*(const Poly<Integer>& p, const Poly<Integer>& q) {
  Poly<Integer> product{p.degree + q.degree, {Integer(0), Integer(0), Integer(0), Integer(0)}};
  for (int i = 0; i <= p.degree; ++i)
    for (int j = 0; j <= q.degree; ++j) product.c[i + j] = product.c[i + j] + p.c[i] * q.c[j];
  return product;
}

}  // namespace lazyccd::exact
