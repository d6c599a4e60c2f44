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

/// One of 2^level equal parts of an interval, as t : 1-t at both ends, and the products of two
/// ends.
template <class Integer>
struct Part {
  Integer later0, earlier0, later1, earlier1;
  // Products at the start, at the end, and of both ends; the last ones as a quadratic needs them.
  Integer later0_2, both0, earlier0_2, later1_2, both1, earlier1_2, twice_later, crossed,
      twice_earlier;

  Part() = default;
  LAZYCCD_HD LAZYCCD_CALLED Part(const Integer& index, int level) {
    const Integer one(1);
    later0 = index;
    later1 = index + one;
    earlier0 = (one << level) - index;
    earlier1 = earlier0 - one;
    later0_2 = later0 * later0;
    both0 = later0 * earlier0;
    earlier0_2 = earlier0 * earlier0;
    later1_2 = later1 * later1;
    both1 = later1 * earlier1;
    earlier1_2 = earlier1 * earlier1;
    crossed = Integer::dot({later0, later1}, {earlier1, earlier0});
    twice_later = (later0 * later1) << 1;
    twice_earlier = (earlier0 * earlier1) << 1;
  }
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
  LAZYCCD_HD static Poly quadratic(const Integer& c0, const Integer& c1, const Integer& c2) {
    return {2, {c0, c1, c2, Integer(0)}};
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
    if (degree == 0) return c[0];
    Integer value = c[degree], power = earlier;
    for (int i = degree; i-- > 0;) {
      value = Integer::dot({value, c[i]}, {later, power});
      if (i > 0) power = power * earlier;
    }
    return value;
  }
  /// A positive multiple of p over a part of the interval, mapped to [0, 1].
  LAZYCCD_HD LAZYCCD_CALLED Poly over(const Part<Integer>& part) const {
    const Integer zero(0);
    if (degree == 0) return *this;
    if (degree == 1) {
      return {1,
              {Integer::dot({c[0], c[1]}, {part.earlier0, part.later0}),
               Integer::dot({c[0], c[1]}, {part.earlier1, part.later1}), zero, zero}};
    }
    if (degree == 2) {
      // Of each product of two factors, one at the start and one at the end of the part.
      return {
          2,
          {Integer::dot({c[0], c[1], c[2]}, {part.earlier0_2, part.both0, part.later0_2}),
           Integer::dot({c[0], c[1], c[2]}, {part.twice_earlier, part.crossed, part.twice_later}),
           Integer::dot({c[0], c[1], c[2]}, {part.earlier1_2, part.both1, part.later1_2}), zero}};
    }
    return {3,
            {at(part.later0, part.earlier0),
             between(part.later0_2, part.both0, part.earlier0_2, part.later1, part.earlier1),
             between(part.later1_2, part.both1, part.earlier1_2, part.later0, part.earlier0),
             at(part.later1, part.earlier1)}};
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
  LAZYCCD_HD LAZYCCD_CALLED Integer between(const Integer& later_2, const Integer& both,
                                            const Integer& earlier_2, const Integer& later,
                                            const Integer& earlier) const {
    const Integer three(3), twice = both << 1;
    return Integer::dot(
        {c[0], c[1], c[2], c[3]},
        {earlier_2 * earlier * three, Integer::dot({earlier_2, twice}, {later, earlier}),
         Integer::dot({twice, later_2}, {later, earlier}), later_2 * later * three});
  }
};

/// Most levels of guessed_part(): so many halvings a double follows.
constexpr int kGuessedLevels = 32;

/// Returns the part of 2^levels that probably holds the only root of p in the interval. p changes
/// its sign there; first_sign is that just after the start.
template <class Integer>
LAZYCCD_HD LAZYCCD_CALLED std::int64_t guessed_part(const Poly<Integer>& p, int first_sign,
                                                    int levels) {
  int bits = 0;
  for (int i = 0; i <= p.degree; ++i) {
    const int own = p.c[i].bit_length();
    if (own > bits) bits = own;
  }
  const int below = bits > 60 ? bits - 60 : 0;
  double c[4] = {0, 0, 0, 0};
  for (int i = 0; i <= p.degree; ++i) c[i] = static_cast<double>(p.c[i].above(below));
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
    if (value * first_sign > 0) {
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

}  // namespace lazyccd::exact
