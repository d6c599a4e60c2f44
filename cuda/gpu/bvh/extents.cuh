// Union of extents, by one thread and over a warp.
#pragma once

#include "gpu/device/kernel_chain.cuh"
#include "gpu/scene/group_view.cuh"

namespace lazyccd::gpu {

__device__ inline AxisExtent empty_extent() { return {INFINITY, -INFINITY, INFINITY, -INFINITY}; }

__device__ inline void unite(AxisExtent& a, const AxisExtent& b) {
  a = {fminf(a.lo0, b.lo0), fmaxf(a.hi0, b.hi0), fminf(a.lo1, b.lo1), fmaxf(a.hi1, b.hi1)};
}

// Minimum and maximum over a warp. There is one instruction for integers. Floats are ordered like
// integers once the bits of negative floats are flipped. The values are never NaN.
__device__ inline int ordered(int bits) { return bits ^ (bits >> 31 & 0x7fffffff); }
__device__ inline float warp_min(float x) {
#if __CUDA_ARCH__ >= 800
  return __int_as_float(ordered(__reduce_min_sync(kAllLanes, ordered(__float_as_int(x)))));
#else
  for (int offset = kWarp / 2; offset > 0; offset /= 2)
    x = fminf(x, __shfl_xor_sync(kAllLanes, x, offset));
  return x;
#endif
}
__device__ inline float warp_max(float x) { return -warp_min(-x); }

__device__ inline AxisExtent united_over_warp(const AxisExtent& e) {
  return {warp_min(e.lo0), warp_max(e.hi0), warp_min(e.lo1), warp_max(e.hi1)};
}

}  // namespace lazyccd::gpu
