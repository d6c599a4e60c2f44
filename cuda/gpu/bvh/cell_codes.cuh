// Morton codes of the cells, as in host/bvh/cell_order.cpp.
#pragma once

#include <cfloat>

#include "core/bvh/morton.h"
#include "gpu/bvh/build_view.cuh"
#include "gpu/device/kernel_chain.cuh"

namespace lazyccd::gpu {

// The bits of a double as an integer of the same order. It is its own inverse.
__device__ inline long long ordered(long long bits) {
  return bits ^ (bits >> 63 & 0x7fffffffffffffffll);
}
__device__ inline long long ordered(double x) { return ordered(__double_as_longlong(x)); }
__device__ inline double unordered(long long bits) { return __longlong_as_double(ordered(bits)); }

/// Clears the bounds.
__global__ void clear_bounds(BuildView view) {
  if (threadIdx.x < 6) view.bounds[threadIdx.x] = ordered(threadIdx.x < 3 ? DBL_MAX : -DBL_MAX);
}

/// Finds the bounds of the positions at the start, three scalars per vertex.
template <class Scalar>
__global__ void find_bounds(BuildView view, const Scalar* start) {
  double lo[3] = {DBL_MAX, DBL_MAX, DBL_MAX}, hi[3] = {-DBL_MAX, -DBL_MAX, -DBL_MAX};
  for (std::size_t v = blockIdx.x * blockDim.x + threadIdx.x;
       v < static_cast<std::size_t>(view.vertex_count); v += gridDim.x * blockDim.x) {
    for (int k = 0; k < 3; ++k) {
      lo[k] = fmin(lo[k], static_cast<double>(start[3 * v + k]));
      hi[k] = fmax(hi[k], static_cast<double>(start[3 * v + k]));
    }
  }
  __shared__ double of_warp[kWarp][6];
  const int lane = threadIdx.x % kWarp, warp = threadIdx.x / kWarp;
  for (int k = 0; k < 3; ++k) {
    for (int offset = kWarp / 2; offset > 0; offset /= 2) {
      lo[k] = fmin(lo[k], __shfl_xor_sync(kAllLanes, lo[k], offset));
      hi[k] = fmax(hi[k], __shfl_xor_sync(kAllLanes, hi[k], offset));
    }
    if (lane == 0) {
      of_warp[warp][k] = lo[k];
      of_warp[warp][3 + k] = hi[k];
    }
  }
  __syncthreads();
  if (threadIdx.x >= 6) return;
  const bool is_lower = threadIdx.x < 3;
  double bound = of_warp[0][threadIdx.x];
  for (int w = 1; w < static_cast<int>(blockDim.x) / kWarp; ++w)
    bound = is_lower ? fmin(bound, of_warp[w][threadIdx.x]) : fmax(bound, of_warp[w][threadIdx.x]);
  if (is_lower) {
    atomicMin(view.bounds + threadIdx.x, ordered(bound));
  } else {
    atomicMax(view.bounds + threadIdx.x, ordered(bound));
  }
}

/// Returns the cube of the codes; find_bounds() has run.
__device__ inline MortonFrame morton_frame(const BuildView& view) {
  double lo[3], hi[3];
  for (int k = 0; k < 3; ++k) {
    lo[k] = unordered(view.bounds[k]);
    hi[k] = unordered(view.bounds[3 + k]);
  }
  return MortonFrame::around(lo, hi);
}

/// Computes the codes of the cells, one thread per cell.
template <class Scalar>
__global__ void find_cell_codes(BuildView view, const Scalar* start, std::uint64_t* codes,
                                std::int32_t* cells) {
  const std::int32_t i = static_cast<std::int32_t>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i >= view.cell_count) return;
  const CellContents cell(view.contents, view.segment_of_cell(i).has_faces != 0,
                          view.primitive_of(i));
  codes[i] = centroid_code(morton_frame(view), cell.vertex, cell.vertices,
                           [&](std::int32_t v) { return start + 3 * static_cast<std::size_t>(v); });
  cells[i] = i;
}

/// Finds the segments of the cells, one thread per cell.
__global__ void find_segments(BuildView view, const std::int32_t* cells, std::uint32_t* segments) {
  const std::int32_t i = static_cast<std::int32_t>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < view.cell_count) segments[i] = static_cast<std::uint32_t>(view.segment_index(cells[i]));
}

}  // namespace lazyccd::gpu
