// Signed integers of 1024 bits with one limb of 32 bits per lane of a warp: FixedInteger
// (core/exact/fixed_integer.h) for the device. All lanes take part in each operation.
#pragma once

#include <cstdint>

#include "core/exact/fixed_integer.h"
#include "gpu/device/kernel_chain.cuh"

namespace lazyccd::gpu {

/// Two's complement; lane 0 has the lowest limb. Operations wrap around. Blocks have one dimension.
class WarpInteger {
 public:
  WarpInteger() = default;
  __device__ explicit WarpInteger(std::int64_t x)
      : limb_(lane() == 0   ? static_cast<std::uint32_t>(x)
              : lane() == 1 ? static_cast<std::uint32_t>(x >> 32)
                            : static_cast<std::uint32_t>(x >> 63)) {
    static_assert(exact::kIntegerBits == 32 * kWarp);
  }

  __device__ int sign() const {
    const unsigned nonzero = __ballot_sync(kAllLanes, limb_ != 0);
    if (nonzero == 0) return 0;
    return is_negative() ? -1 : 1;
  }

  /// As those of FixedInteger.
  __device__ int bit_length() const {
    const std::uint32_t limb = is_negative() ? ~limb_ : limb_;
    const unsigned nonzero = __ballot_sync(kAllLanes, limb != 0);
    if (nonzero == 0) return 0;
    const int highest = kWarp - 1 - __clz(static_cast<int>(nonzero));
    const std::uint32_t top = __shfl_sync(kAllLanes, limb, highest);
    return 32 * highest + 32 - __clz(static_cast<int>(top));
  }
  __device__ std::int64_t above(int low) const {
    const int limb = low / 32, rest = low % 32;
    const std::uint32_t sign = is_negative() ? ~std::uint32_t{0} : 0;
    const auto at = [&](int i) {
      const std::uint32_t own = __shfl_sync(kAllLanes, limb_, i & (kWarp - 1));
      return i < kWarp ? own : sign;
    };
    const std::uint32_t a = at(limb), b = at(limb + 1), c = at(limb + 2);
    const std::uint64_t lower = __funnelshift_r(a, b, static_cast<unsigned>(rest)),
                        upper = __funnelshift_r(b, c, static_cast<unsigned>(rest));
    return static_cast<std::int64_t>(upper << 32 | lower);
  }

  friend __device__ WarpInteger operator+(const WarpInteger& a, const WarpInteger& b) {
    return add(a.limb_, b.limb_, 0);
  }
  friend __device__ WarpInteger operator-(const WarpInteger& a, const WarpInteger& b) {
    return add(a.limb_, ~b.limb_, 1);
  }
  friend __device__ __noinline__ WarpInteger operator*(const WarpInteger& a, const WarpInteger& b) {
    // The product modulo 2^1024 of numbers in two's complement needs no signs, but a negative
    // number has all limbs. So y is the shorter one, made positive.
    const bool swaps = a.used_limbs() < b.used_limbs();
    WarpInteger longer = of_limb(swaps ? b.limb_ : a.limb_),
                shorter = of_limb(swaps ? a.limb_ : b.limb_);
    if (shorter.is_negative()) {
      longer = longer.negated();
      shorter = shorter.negated();
    }
    std::uint32_t x = longer.limb_;
    const std::uint32_t y = shorter.limb_;
    // Lane l sums the products of limbs i of y and l - i of x.
    const unsigned used = __ballot_sync(kAllLanes, y != 0);
    std::uint64_t sum = 0;
    std::uint32_t carries = 0;
#pragma unroll 1
    for (int i = 0; i < 32 - __clz(static_cast<int>(used)); ++i) {
      const std::uint64_t product = std::uint64_t{x} * __shfl_sync(kAllLanes, y, i);
      sum += product;
      carries += sum < product;
      x = __shfl_up_sync(kAllLanes, x, 1);
      if (lane() == 0) x = 0;
    }
    const auto from_below = [](std::uint32_t limb, unsigned lanes) {
      const std::uint32_t below = __shfl_up_sync(kAllLanes, limb, lanes);
      return lane() < static_cast<int>(lanes) ? 0 : below;
    };
    const std::uint32_t middle = from_below(static_cast<std::uint32_t>(sum >> 32), 1);
    const std::uint32_t high = from_below(carries, 2);
    return add(add(static_cast<std::uint32_t>(sum), middle, 0).limb_, high, 0);
  }
  /// bits: 0 to 1023, the same in all lanes.
  friend __device__ WarpInteger operator<<(const WarpInteger& a, int bits) {
    const int limbs = bits / 32, rest = bits % 32;
    std::uint32_t own = __shfl_sync(kAllLanes, a.limb_, (lane() - limbs) & (kWarp - 1));
    std::uint32_t below = __shfl_sync(kAllLanes, a.limb_, (lane() - limbs - 1) & (kWarp - 1));
    if (lane() < limbs) own = 0;
    if (lane() < limbs + 1) below = 0;
    return of_limb(__funnelshift_l(below, own, static_cast<unsigned>(rest)));
  }

 private:
  __device__ static int lane() { return static_cast<int>(threadIdx.x % kWarp); }
  __device__ static WarpInteger of_limb(std::uint32_t limb) {
    WarpInteger x;
    x.limb_ = limb;
    return x;
  }
  __device__ bool is_negative() const {
    return static_cast<std::int32_t>(__shfl_sync(kAllLanes, limb_, kWarp - 1)) < 0;
  }
  // The limbs that differ from the sign, a bit for each. A number with a higher bit is longer.
  __device__ unsigned used_limbs() const {
    return __ballot_sync(kAllLanes, limb_ != (is_negative() ? ~std::uint32_t{0} : 0));
  }
  __device__ WarpInteger negated() const { return add(0, ~limb_, 1); }

  // a + b + carry. Carries run through limbs that are all ones: an addition of the lanes' bits lets
  // them run through all lanes at once.
  __device__ static WarpInteger add(std::uint32_t a, std::uint32_t b, unsigned carry) {
    const std::uint32_t sum = a + b;
    const unsigned makes = __ballot_sync(kAllLanes, sum < a);
    const unsigned passes = __ballot_sync(kAllLanes, sum == ~std::uint32_t{0});
    const unsigned carried = ((makes << 1 | carry) + passes) ^ passes;
    return of_limb(sum + (carried >> lane() & 1));
  }

  std::uint32_t limb_;
};

}  // namespace lazyccd::gpu
