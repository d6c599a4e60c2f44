// Extents united, by a thread and over a warp.
#pragma once

#include "gpu/scene/group_view.cuh"
#include "gpu/device/kernel_chain.cuh"

namespace lazyccd::gpu {

__device__ inline AxisExtent empty_extent() { return {INFINITY, -INFINITY, INFINITY, -INFINITY}; }

__device__ inline void unite(AxisExtent& a, const AxisExtent& b) {
  a = {fminf(a.lo0, b.lo0), fmaxf(a.hi0, b.hi0), fminf(a.lo1, b.lo1), fmaxf(a.hi1, b.hi1)};
}

// Least and largest over a warp: one instruction for integers, which floats are in order once the
// bits of negative ones are flipped. No NaN gets here.
__device__ inline int ordered(int bits) { return bits ^ (bits >> 31 & 0x7fffffff); }
__device__ inline float least_of_warp(float x) {
#if __CUDA_ARCH__ >= 800
  return __int_as_float(ordered(__reduce_min_sync(kAllLanes, ordered(__float_as_int(x)))));
#else
  for (int offset = kWarp / 2; offset > 0; offset /= 2)
    x = fminf(x, __shfl_xor_sync(kAllLanes, x, offset));
  return x;
#endif
}
__device__ inline float largest_of_warp(float x) { return -least_of_warp(-x); }

__device__ inline AxisExtent united_over_warp(const AxisExtent& e) {
  return {least_of_warp(e.lo0), largest_of_warp(e.hi0), least_of_warp(e.lo1),
          largest_of_warp(e.hi1)};
}

}  // namespace lazyccd::gpu
