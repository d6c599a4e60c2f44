// Signed integers of 256 bits that notice an overflow. Most queries need no more, and one thread
// works on them faster than a warp on longer ones.
#pragma once

#include <cstdint>

#include "core/platform.h"

namespace lazyccd::exact {

/// Two's complement, lowest word first. After an overflow the values are wrong: Overflow::note()
/// was called, and Overflow::noted() returns true from then on.
template <class Overflow>
class NarrowInteger {
 public:
  NarrowInteger() = default;
  LAZYCCD_HD explicit NarrowInteger(std::int64_t x) {
    word_[0] = static_cast<std::uint64_t>(x);
    for (int i = 1; i < kWords; ++i) word_[i] = x < 0 ? ~std::uint64_t{0} : 0;
  }
  LAZYCCD_HD static bool overflowed() { return Overflow::noted(); }

  LAZYCCD_HD int sign() const {
    if (is_negative()) return -1;
    return (word_[0] | word_[1] | word_[2] | word_[3]) != 0 ? 1 : 0;
  }
  /// Bits of the absolute value, or one less for a negative power of two.
  LAZYCCD_HD int bit_length() const {
    const std::uint64_t flip = is_negative() ? ~std::uint64_t{0} : 0;
    int length = 0;
    for (int i = 0; i < kWords; ++i)
      if ((word_[i] ^ flip) != 0) length = 64 * i + bits_of(word_[i] ^ flip);
    return length;
  }
  /// The bits from place `low` on, 0 to 255, as a signed integer. They must be less than 64.
  LAZYCCD_HD std::int64_t above(int low) const {
    const int rest = low % 64;
    std::uint64_t bits = 0;
    for (int i = 0; i < kWords; ++i) {
      if (i == low / 64) bits |= word_[i] >> rest;
      if (i == low / 64 + 1 && rest != 0) bits |= word_[i] << (64 - rest);
    }
    if (low / 64 == kWords - 1 && rest != 0 && is_negative())
      bits |= ~std::uint64_t{0} << (64 - rest);
    return static_cast<std::int64_t>(bits);
  }

  LAZYCCD_HD friend NarrowInteger operator+(const NarrowInteger& a, const NarrowInteger& b) {
    const NarrowInteger sum = add(a, b, 0, 0);
    if (a.is_negative() == b.is_negative() && sum.is_negative() != a.is_negative())
      Overflow::note();
    return sum;
  }
  LAZYCCD_HD friend NarrowInteger operator-(const NarrowInteger& a, const NarrowInteger& b) {
    const NarrowInteger difference = add(a, b, ~std::uint64_t{0}, 1);
    if (a.is_negative() != b.is_negative() && difference.is_negative() != a.is_negative())
      Overflow::note();
    return difference;
  }
  LAZYCCD_HD friend NarrowInteger operator*(const NarrowInteger& a, const NarrowInteger& b) {
    if (a.bit_length() + b.bit_length() > kMostBits) Overflow::note();
    const NarrowInteger x = a.magnitude(), y = b.magnitude();
    NarrowInteger product(0);
    for (int j = 0; j < kWords; ++j) {
      if (y.word_[j] == 0) continue;
      std::uint64_t carry = 0;
      for (int i = 0; i + j < kWords; ++i) {
        const std::uint64_t low = x.word_[i] * y.word_[j];
        std::uint64_t high = high_product(x.word_[i], y.word_[j]);
        std::uint64_t sum = product.word_[i + j] + low;
        high += sum < low;
        sum += carry;
        high += sum < carry;
        product.word_[i + j] = sum;
        carry = high;
      }
    }
    return a.is_negative() != b.is_negative() ? product.negated() : product;
  }
  /// bits: 0 to 255.
  LAZYCCD_HD friend NarrowInteger operator<<(const NarrowInteger& a, int bits) {
    if (a.bit_length() + bits > kMostBits) Overflow::note();
    const int words = bits / 64, rest = bits % 64;
    NarrowInteger shifted(0);
    for (int i = 0; i < kWords; ++i)
      for (int from = 0; from <= i; ++from) {  // constant indices keep the words in registers
        if (i - from == words) shifted.word_[i] |= a.word_[from] << rest;
        if (i - from == words + 1 && rest != 0) shifted.word_[i] |= a.word_[from] >> (64 - rest);
      }
    return shifted;
  }

 private:
  static constexpr int kWords = 4, kMostBits = 64 * kWords - 2;

  LAZYCCD_HD bool is_negative() const { return word_[kWords - 1] >> 63 != 0; }
  LAZYCCD_HD NarrowInteger negated() const {
    return add(NarrowInteger(0), *this, ~std::uint64_t{0}, 1);
  }
  LAZYCCD_HD NarrowInteger magnitude() const { return is_negative() ? negated() : *this; }

  LAZYCCD_HD static NarrowInteger add(const NarrowInteger& a, const NarrowInteger& b,
                                      std::uint64_t flip, std::uint64_t carry) {
    NarrowInteger sum;
    for (int i = 0; i < kWords; ++i) {
      const std::uint64_t first = a.word_[i] + carry, word = b.word_[i] ^ flip;
      carry = first < carry;
      sum.word_[i] = first + word;
      carry += sum.word_[i] < word;
    }
    return sum;
  }
  // Position of the highest bit that is set, from 1; x is not 0.
  LAZYCCD_HD static int bits_of(std::uint64_t x) {
#if defined(__CUDA_ARCH__)
    return 64 - __clzll(static_cast<long long>(x));
#else
    int bits = 1;
    for (int step = 32; step > 0; step /= 2)
      if (x >> step != 0) {
        x >>= step;
        bits += step;
      }
    return bits;
#endif
  }
  // The upper word of a product.
  LAZYCCD_HD static std::uint64_t high_product(std::uint64_t a, std::uint64_t b) {
#if defined(__CUDA_ARCH__)
    return __umul64hi(a, b);
#else
    const std::uint64_t low = 0xffffffffu, a0 = a & low, a1 = a >> 32, b0 = b & low, b1 = b >> 32;
    const std::uint64_t middle = a1 * b0 + (a0 * b0 >> 32), other = a0 * b1 + (middle & low);
    return a1 * b1 + (middle >> 32) + (other >> 32);
#endif
  }

  std::uint64_t word_[kWords];
};

}  // namespace lazyccd::exact
