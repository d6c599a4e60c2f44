// Signed integers of 1024 bits.
#pragma once

#include <cstdint>

namespace lazyccd::exact {

constexpr int kIntegerBits = 1024;

/// Two's complement. Operations wrap around; the caller keeps all values small enough.
class FixedInteger {
 public:
  FixedInteger() = default;
  explicit FixedInteger(std::int64_t x) {
    const std::uint64_t bits = static_cast<std::uint64_t>(x);
    limb_[0] = static_cast<std::uint32_t>(bits);
    limb_[1] = static_cast<std::uint32_t>(bits >> 32);
    for (int i = 2; i < kLimbs; ++i) limb_[i] = x < 0 ? ~std::uint32_t{0} : 0;
  }

  int sign() const {
    if (limb_[kLimbs - 1] >> 31 != 0) return -1;
    for (const std::uint32_t limb : limb_)
      if (limb != 0) return 1;
    return 0;
  }

  /// Bits of the absolute value, or one less for a negative power of two.
  int bit_length() const {
    const std::uint32_t flip = limb_[kLimbs - 1] >> 31 != 0 ? ~std::uint32_t{0} : 0;
    for (int i = kLimbs; i-- > 0;)
      for (int bit = 32; bit-- > 0;)
        if (((limb_[i] ^ flip) >> bit & 1) != 0) return 32 * i + bit + 1;
    return 0;
  }
  /// The bits from place `low` on, 0 to 1023, as a signed integer. They must be less than 64.
  std::int64_t above(int low) const {
    std::uint64_t bits = 0;
    for (int i = 0; i < 64; ++i) {
      const int at = low + i < kIntegerBits ? low + i : kIntegerBits - 1;
      bits |= std::uint64_t{limb_[at / 32] >> (at % 32) & 1} << i;
    }
    return static_cast<std::int64_t>(bits);
  }

  friend FixedInteger operator+(const FixedInteger& a, const FixedInteger& b) {
    return add(a, b, 0, 0);
  }
  friend FixedInteger operator-(const FixedInteger& a, const FixedInteger& b) {
    return add(a, b, ~std::uint32_t{0}, 1);
  }
  friend FixedInteger operator*(const FixedInteger& a, const FixedInteger& b) {
    FixedInteger product;
    for (int i = 0; i < kLimbs; ++i) {
      std::uint64_t carry = 0;
      for (int j = 0; i + j < kLimbs; ++j) {
        carry += std::uint64_t{a.limb_[i]} * b.limb_[j] + product.limb_[i + j];
        product.limb_[i + j] = static_cast<std::uint32_t>(carry);
        carry >>= 32;
      }
    }
    return product;
  }
  /// The sum of the products a[i] b[i]. Those whose bit in `minus` is set are subtracted.
  template <int n>
  static FixedInteger dot(const FixedInteger (&a)[n], const FixedInteger (&b)[n],
                          unsigned minus = 0) {
    FixedInteger sum;
    for (int i = 0; i < n; ++i) sum = (minus >> i & 1) != 0 ? sum - a[i] * b[i] : sum + a[i] * b[i];
    return sum;
  }
  /// bits: 0 to 1023.
  friend FixedInteger operator<<(const FixedInteger& a, int bits) {
    const int limbs = bits / 32, rest = bits % 32;
    FixedInteger shifted;
    for (int i = kLimbs; i-- > limbs;) {
      const std::uint64_t below = i > limbs ? a.limb_[i - limbs - 1] : 0;
      const std::uint64_t both = std::uint64_t{a.limb_[i - limbs]} << 32 | below;
      shifted.limb_[i] = static_cast<std::uint32_t>(both << rest >> 32);
    }
    return shifted;
  }

 private:
  static constexpr int kLimbs = kIntegerBits / 32;

  static FixedInteger add(const FixedInteger& a, const FixedInteger& b, std::uint32_t flip,
                          std::uint64_t carry) {
    FixedInteger sum;
    for (int i = 0; i < kLimbs; ++i) {
      carry += std::uint64_t{a.limb_[i]} + (b.limb_[i] ^ flip);
      sum.limb_[i] = static_cast<std::uint32_t>(carry);
      carry >>= 32;
    }
    return sum;
  }

  std::uint32_t limb_[kLimbs] = {};
};

}  // namespace lazyccd::exact
