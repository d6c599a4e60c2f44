// Polynomials in time over one step, of degree 3 at most, with integer coefficients.
//
// The code of this folder is for the host and the device. Integer is FixedInteger, or another type
// with the same operations, such as one with a limb in each lane of a warp.
#pragma once

#include <cstdint>

#include "core/platform.h"

/// On the device, keeps a function of long code from being copied into its callers.
#if defined(__CUDA_ARCH__)
#define LAZYCCD_CALLED __noinline__
#else
#define LAZYCCD_CALLED
#endif

namespace lazyccd::exact {

/// One of `count` equal parts of an interval, by its index in time.
template <class Integer>
struct Part {
  Integer index, count;
};

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

  /// A positive multiple of p in the middle of the interval.
  LAZYCCD_HD LAZYCCD_CALLED Integer sum() const {
    Integer total = c[0];
    for (int i = 1; i <= degree; ++i) total = total + c[i];
    return total;
  }
  /// A positive multiple of p where t : 1-t is later : earlier.
  LAZYCCD_HD LAZYCCD_CALLED Integer at(const Integer& later, const Integer& earlier) const {
    Integer value = c[0], power = later;
    for (int i = 1; i <= degree; ++i) {
      value = value * earlier + c[i] * power;
      if (i < degree) power = power * later;
    }
    return value;
  }
  /// A positive multiple of p over a part of the interval, mapped to [0, 1].
  LAZYCCD_HD LAZYCCD_CALLED Poly over(const Part<Integer>& part) const {
    // t is later : earlier at the start of the part and later1 : earlier1 at its end.
    const Integer one(1), later = part.index, later1 = later + one, earlier = part.count - later,
                          earlier1 = earlier - one;
    Poly p{degree, {at(later, earlier), Integer(0), Integer(0), Integer(0)}};
    if (degree > 0) p.c[degree] = at(later1, earlier1);
    if (degree == 2) {
      // Of each product of two factors, one at the start and one at the end of the part.
      const Integer middle = c[1] * (earlier * later1 + later * earlier1);
      const Integer ends = c[0] * (earlier * earlier1) + c[2] * (later * later1);
      p.c[1] = ends + ends + middle;
    }
    if (degree == 3) {
      p.c[1] = between(later, earlier, later1, earlier1);
      p.c[2] = between(later1, earlier1, later, earlier);
    }
    return p;
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

 private:
  // A coefficient of over() for degree 3: the products with two factors at x and one at y.
  LAZYCCD_HD LAZYCCD_CALLED Integer between(const Integer& later_x, const Integer& earlier_x,
                                            const Integer& later_y,
                                            const Integer& earlier_y) const {
    const Integer earlier_2 = earlier_x * earlier_x, later_2 = later_x * later_x,
                  both = earlier_x * later_x;
    const Integer first = c[0] * (earlier_2 * earlier_y), last = c[3] * (later_2 * later_y);
    const Integer ends = first + last;
    return ends + ends + ends + c[1] * (earlier_2 * later_y + ((both * earlier_y) << 1)) +
           c[2] * (((both * later_y) << 1) + later_2 * earlier_y);
  }
};

/// Most levels of guessed_part(): so many halvings a double follows.
constexpr int kGuessedLevels = 32;

/// Returns the part of 2^levels that probably holds the only root of p in the interval. p must
/// change its sign there.
template <class Integer>
LAZYCCD_HD LAZYCCD_CALLED std::int64_t guessed_part(const Poly<Integer>& p, int levels) {
  int bits = 0;
  for (int i = 0; i <= p.degree; ++i) {
    const int own = p.c[i].bit_length();
    if (own > bits) bits = own;
  }
  const int below = bits > 60 ? bits - 60 : 0;
  double c[4] = {0, 0, 0, 0};
  for (int i = 0; i <= p.degree; ++i) c[i] = static_cast<double>(p.c[i].above(below));
  const double first = static_cast<double>(p.first_sign());
  std::int64_t index = 0;
  double t = 0, width = 1;
  for (int i = 0; i < levels; ++i) {
    width *= 0.5;
    const double later = t + width, earlier = 1 - later;
    double value = c[0], power = 1;
    for (int k = 1; k <= p.degree; ++k) {
      power *= later;
      value = value * earlier + c[k] * power;
    }
    index *= 2;
    if (value * first > 0) {
      ++index;
      t = later;
    }
  }
  return index;
}

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
