// Boxes of primitives in half precision, relative to their group: Mahovsky and Wyvill,
// "Memory-Conserving Bounding Volume Hierarchies with Coherent Raytracing" (2006), with numbers of
// 16 bits. They take half the memory of floats, and one instruction compares two bounds.
//
// Every conversion rounds outward, so no contact is lost. What is too large for half precision
// becomes infinite outward, or the largest number inward.
#pragma once

#include <cuda_fp16.h>

#include <cstdint>

#include "gpu/device/kernel_chain.cuh"
#include "gpu/scene/axis_extent.cuh"

namespace lazyccd::gpu {

/// The frame of a group's boxes: x is stored as (x - centre) * scale. The scale is a power of two
/// from 2^-60 to 2^60.
struct alignas(16) GroupFrame {
  float centre[kSides];
  float scale;

  /// The frame in which a box with these sides reaches from -8 to 8 at most.
  __device__ static GroupFrame around(const AxisExtent (&sides)[kSides]) {
    GroupFrame frame;
    float half = 0;
    for (int k = 0; k < kSides; ++k) {
      const float lo = 0.5f * fminf(sides[k].lo0, sides[k].lo1);
      const float hi = 0.5f * fmaxf(sides[k].hi0, sides[k].hi1);
      frame.centre[k] = lo + hi;
      half = fmaxf(half, hi - lo);
    }
    constexpr int bias = 127;
    const int exponent = (__float_as_int(half) >> 23 & 0xff) - bias;
    frame.scale = __int_as_float((min(max(2 - exponent, -60), 60) + bias) << 23);
    return frame;
  }
};

/// A box at both ends of the step, in the frame of a group. word[axis][end] holds two numbers of
/// half precision: the upper bound and, in the upper bits, the negated lower bound. The larger
/// they are, the larger is the box. Flipped: with both numbers in the other order.
struct HalfBox {
  unsigned word[kSides][2];

  __device__ static __half2 numbers(unsigned word) { return reinterpret_cast<__half2&>(word); }
  __device__ static unsigned bits(__half2 numbers) { return reinterpret_cast<unsigned&>(numbers); }

  /// Two bounds, rounded up. A zero never has a sign: the sum of two zeros with a sign would have
  /// that of boxes that are apart.
  __device__ static unsigned rounded_up(float low_half, float high_half) {
    const __half2 rounded = __halves2half2(__float2half_ru(low_half), __float2half_ru(high_half));
    return bits(__hadd2(rounded, __float2half2_rn(0)));
  }

  /// Converts extents to a frame.
  __device__ static HalfBox in_frame(const AxisExtent (&e)[kSides], const GroupFrame& frame) {
    HalfBox box;
    for (int k = 0; k < kSides; ++k) {
      const auto word = [&](float lo, float hi) {
        const float c = frame.centre[k];
        return rounded_up(__fmul_ru(__fsub_ru(hi, c), frame.scale),
                          __fmul_ru(__fsub_ru(c, lo), frame.scale));
      };
      box.word[k][0] = word(e[k].lo0, e[k].hi0);
      box.word[k][1] = word(e[k].lo1, e[k].hi1);
    }
    return box;
  }

  /// The same, flipped, by one warp: each lane converts one word.
  __device__ static HalfBox flipped_in_frame(const AxisExtent* sides, const GroupFrame& frame,
                                             int lane) {
    const int i = min(lane, 2 * kSides - 1);
    const float2 bounds = reinterpret_cast<const float2*>(sides)[i];
    const float c = i < 2 ? frame.centre[0] : i < 4 ? frame.centre[1] : frame.centre[2];
    const unsigned mine = rounded_up(__fmul_ru(__fsub_ru(c, bounds.x), frame.scale),
                                     __fmul_ru(__fsub_ru(bounds.y, c), frame.scale));
    HalfBox box;
    for (int k = 0; k < kSides; ++k)
      for (int end = 0; end < 2; ++end)
        box.word[k][end] = __shfl_sync(kAllLanes, mine, 2 * k + end);
    return box;
  }

  /// Returns whether two boxes of one frame are certainly apart during the linear motion: along an
  /// axis, on the same side at both ends. `flipped` is flipped, this box is not. Each word of the
  /// sum holds both gaps of an axis, negative where the boxes are apart; half precision adds with
  /// the sign of the exact sum.
  __device__ bool apart(const HalfBox& flipped) const {
    unsigned signs = 0;
    for (int k = 0; k < kSides; ++k)
      signs |= bits(__hadd2(numbers(word[k][0]), numbers(flipped.word[k][0]))) &
               bits(__hadd2(numbers(word[k][1]), numbers(flipped.word[k][1])));
    return (signs & 0x80008000u) != 0;
  }
};

/// Takes boxes from the frame of one group to that of another.
struct FrameChange {
  float ratio;                                       // of the scales
  float upper_shift[kSides], negated_shift[kSides];  // of upper and of negated lower bounds

  __device__ FrameChange(const GroupFrame& from, const GroupFrame& to) {
    // The quotient of two powers of two.
    ratio = __int_as_float(__float_as_int(to.scale) - __float_as_int(from.scale) +
                           __float_as_int(1.0f));
    for (int k = 0; k < kSides; ++k) {
      upper_shift[k] = __fmul_ru(__fsub_ru(from.centre[k], to.centre[k]), to.scale);
      negated_shift[k] = __fmul_ru(__fsub_ru(to.centre[k], from.centre[k]), to.scale);
    }
  }

  /// The box in the other frame, flipped.
  __device__ HalfBox flipped(const HalfBox& box) const {
    HalfBox result;
    for (int k = 0; k < kSides; ++k)
      for (int end = 0; end < 2; ++end) {
        const float2 bounds = __half22float2(HalfBox::numbers(box.word[k][end]));
        result.word[k][end] = HalfBox::rounded_up(__fmaf_ru(bounds.y, ratio, negated_shift[k]),
                                                  __fmaf_ru(bounds.x, ratio, upper_shift[k]));
      }
    return result;
  }
};

/// Boxes side by side. The axes x and y, and the axis z, have arrays of their own, because memory
/// is read in pieces of 16 or 8 bytes.
struct BoxArrays {
  uint4* xy;
  uint2* z;

  static constexpr std::size_t kBytes = sizeof(uint4) + sizeof(uint2);  ///< of a box

  __device__ HalfBox load(int place) const {
    const uint4 w = xy[place];
    const uint2 v = z[place];
    return {{{w.x, w.y}, {w.z, w.w}, {v.x, v.y}}};
  }
  __device__ void store(int place, const HalfBox& box) const {
    xy[place] = {box.word[0][0], box.word[0][1], box.word[1][0], box.word[1][1]};
    z[place] = {box.word[2][0], box.word[2][1]};
  }
};

}  // namespace lazyccd::gpu
