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

  friend __device__ WarpInteger operator+(const WarpInteger& a, const WarpInteger& b) {
    return add(a.limb_, b.limb_, 0);
  }
  friend __device__ WarpInteger operator-(const WarpInteger& a, const WarpInteger& b) {
    return add(a.limb_, ~b.limb_, 1);
  }
  friend __device__ __noinline__ WarpInteger operator*(const WarpInteger& a, const WarpInteger& b) {
    const bool a_negative = a.is_negative(), b_negative = b.is_negative();
    std::uint32_t x = a_negative ? a.negated().limb_ : a.limb_;
    const std::uint32_t y = b_negative ? b.negated().limb_ : b.limb_;
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
    const WarpInteger product = add(add(static_cast<std::uint32_t>(sum), middle, 0).limb_, high, 0);
    return a_negative != b_negative ? product.negated() : product;
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
