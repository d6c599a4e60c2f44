// Signed integers of 1024 bits with one limb of 32 bits per lane of a warp: FixedInteger
// (core/exact/fixed_integer.h) for the device. All lanes take part in each operation.
#pragma once

#include <cstdint>
#include <utility>

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
    return is_negative(limb_) ? -1 : 1;
  }

  /// As those of FixedInteger.
  __device__ int bit_length() const {
    const std::uint32_t limb = is_negative(limb_) ? ~limb_ : limb_;
    const unsigned nonzero = __ballot_sync(kAllLanes, limb != 0);
    if (nonzero == 0) return 0;
    const int highest = kWarp - 1 - __clz(static_cast<int>(nonzero));
    const std::uint32_t top = __shfl_sync(kAllLanes, limb, highest);
    return 32 * highest + 32 - __clz(static_cast<int>(top));
  }
  __device__ std::int64_t above(int low) const {
    const int limb = low / 32, rest = low % 32;
    const std::uint32_t sign = is_negative(limb_) ? ~std::uint32_t{0} : 0;
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
    return of_limb(sum(a.limb_, b.limb_, 0));
  }
  friend __device__ WarpInteger operator-(const WarpInteger& a, const WarpInteger& b) {
    return of_limb(sum(a.limb_, ~b.limb_, 1));
  }
  friend __device__ WarpInteger operator*(const WarpInteger& a, const WarpInteger& b) {
    return of_limb(dot_limb(0, a.limb_, b.limb_));
  }
  /// As that of FixedInteger. It takes longest if all b are long.
  template <int n>
  __device__ static WarpInteger dot(const WarpInteger (&a)[n], const WarpInteger (&b)[n],
                                    unsigned minus = 0) {
    return dot(a, b, minus, std::make_integer_sequence<int, n>());
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
  __device__ static bool is_negative(std::uint32_t limb) {
    return static_cast<std::int32_t>(__shfl_sync(kAllLanes, limb, kWarp - 1)) < 0;
  }
  // a + b + carry. Carries run through limbs that are all ones: an addition of the lanes' bits lets
  // them run through all lanes at once.
  __device__ static std::uint32_t sum(std::uint32_t a, std::uint32_t b, unsigned carry) {
    const std::uint32_t own = a + b;
    const unsigned makes = __ballot_sync(kAllLanes, own < a);
    const unsigned passes = __ballot_sync(kAllLanes, own == ~std::uint32_t{0});
    const unsigned carried = ((makes << 1 | carry) + passes) ^ passes;
    return own + (carried >> lane() & 1);
  }
  // The limb of a lower lane, or 0.
  __device__ static std::uint32_t from_below(std::uint32_t limb, int lanes) {
    const std::uint32_t below = __shfl_up_sync(kAllLanes, limb, static_cast<unsigned>(lanes));
    return lane() < lanes ? 0 : below;
  }

  template <int n, int... k>
  __device__ static WarpInteger dot(const WarpInteger (&a)[n], const WarpInteger (&b)[n],
                                    unsigned minus, std::integer_sequence<int, k...>) {
    return of_limb(dot_limb(minus, a[k].limb_..., b[k].limb_...));
  }

  // A limb of the dot product, modulo 2^1024, of numbers with these limbs: first all of a, then all
  // of b. It is not inlined, and takes limbs because those are passed in registers.
  template <class... Limbs>
  __device__ __noinline__ static std::uint32_t dot_limb(unsigned minus, Limbs... limbs) {
    constexpr int n = sizeof...(limbs) / 2;
    const std::uint32_t all[] = {limbs...};
    std::uint32_t x[n], y[n];
    for (int k = 0; k < n; ++k) {
      x[k] = all[k];
      y[k] = all[n + k];
    }

    // Sums of this lane, which wait for carries. The low one has 64 bits.
    std::uint64_t total = 0;
    std::uint32_t carries = 0;
    const auto add = [&](std::uint64_t part) {
      total += part;
      carries += total < part;
    };

    bool is_long = false;
    std::uint32_t negative[n], negatives = 0;
    for (int k = 0; k < n; ++k) {
      const std::uint32_t flip = 0 - (minus >> k & 1);  // -x y is x (~y) + x
      y[k] ^= flip;
      add(x[k] & flip);
      negative[k] = is_negative(y[k]) ? ~std::uint32_t{0} : 0;
      negatives -= negative[k];
      is_long = is_long || y[k] != negative[k];
    }
    const unsigned used = __ballot_sync(kAllLanes, is_long);
    const int used_limbs = kWarp - __clz(static_cast<int>(used));

    // Lane l sums the products of limbs i of y and l - i of x.
#pragma unroll 1
    for (int i = 0; i < used_limbs; ++i) {
      for (int k = 0; k < n; ++k) {
        add(std::uint64_t{x[k]} * __shfl_sync(kAllLanes, y[k], i));
        x[k] = from_below(x[k], 1);
      }
    }
    // The limbs above are those of the sign: for a negative y, -1 in the place `used_limbs`. -x is
    // ~x + 1.
    for (int k = 0; k < n; ++k) add(~x[k] & negative[k]);
    if (lane() == 0) add(negatives);

    const std::uint32_t middle = from_below(static_cast<std::uint32_t>(total >> 32), 1);
    const std::uint32_t high = from_below(carries, 2);
    return sum(sum(static_cast<std::uint32_t>(total), middle, 0), high, 0);
  }

  std::uint32_t limb_;
};

}  // namespace lazyccd::gpu
