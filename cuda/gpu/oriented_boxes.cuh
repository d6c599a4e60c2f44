// Oriented boxes of all nodes, fitted anew each step: leaves from their vertices, runs of leaves
// from the leaves' boxes, nodes from both. The moments come first, then the axes, one volume a
// thread, then the extents along them.
#pragma once

#include "core/oriented_box.h"
#include "core/separation.h"
#include "gpu/kernel_chain.cuh"
#include "gpu/node_parts.cuh"
#include "gpu/scene.cuh"

namespace lazyccd::gpu {

struct OrientedBoxesView {
  OrientedBox *leaves, *runs, *nodes;  // leaves in their order
  Moments *leaf_moments, *run_moments;
};

__device__ inline Moments united_over_warp(Moments m) {
  for (int offset = kWarp / 2; offset > 0; offset /= 2) {
    m.count += __shfl_xor_sync(kAllLanes, m.count, offset);
    for (double& x : m.sum) x += __shfl_xor_sync(kAllLanes, x, offset);
    for (double& x : m.product) x += __shfl_xor_sync(kAllLanes, x, offset);
  }
  return m;
}

__device__ inline AxesExtent united_over_warp(AxesExtent e) {
  for (int offset = kWarp / 2; offset > 0; offset /= 2) {
    AxesExtent other;
    for (int i = 0; i < 3; ++i) {
      other.lo[i] = __shfl_xor_sync(kAllLanes, e.lo[i], offset);
      other.hi[i] = __shfl_xor_sync(kAllLanes, e.hi[i], offset);
    }
    other.size = __shfl_xor_sync(kAllLanes, e.size, offset);
    e.add(other);
  }
  return e;
}

constexpr std::uint32_t kFitWarps = kRun;  // of a block, each with one volume
constexpr std::uint32_t kFitBlock = kFitWarps * kWarp;

// What the warps of a block share.
struct FitScratch {
  Moments moments[kFitWarps];
  double axis[kFitWarps][3][3];
};

// A volume for each warp of the block, from its lanes' moments() and extent(axis); all threads
// call. Returns its box in all lanes and leaves its moments in the scratch.
template <class MomentsOf, class ExtentOf>
__device__ inline OrientedBox fit(FitScratch& scratch, double margin, MomentsOf&& moments,
                                  ExtentOf&& extent) {
  const std::uint32_t warp = threadIdx.x / kWarp;
  const Moments sum = united_over_warp(moments());
  if (threadIdx.x % kWarp == 0) scratch.moments[warp] = sum;
  __syncthreads();
  if (threadIdx.x < kFitWarps)
    principal_axes(scratch.moments[threadIdx.x], scratch.axis[threadIdx.x]);
  __syncthreads();
  double axis[3][3];
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) axis[i][k] = scratch.axis[warp][i][k];
  return enclose(axis, united_over_warp(extent(axis)), margin);
}

template <class Record>
__global__ void __launch_bounds__(kFitBlock, 1)
    fit_leaves(SceneView scene, OrientedBoxesView boxes) {
  begin_kernel();
  __shared__ FitScratch scratch;
  __shared__ OrientedBox leaves[kRun];
  const int lane = threadIdx.x % kWarp, warp = threadIdx.x / kWarp;
  const std::uint32_t slot = blockIdx.x * kRun + warp;
  const bool used = slot < scene.group_count;
  const Record* records = static_cast<const Record*>(scene.records);
  const auto for_each_end = [&](auto&& f) {
    if (!used) return;
    for_each_cell(scene.groups, scene.leaf_order[slot], lane, [&](const PrimitiveNames& cell) {
      for (int k = 0; k < 3; ++k) {
        if (cell.vertex[k] < 0) break;
        const Record record = load_wide(records + cell.vertex[k]);
        f(record.x);
        f(record.x + 3);
      }
    });
  };
  const OrientedBox box = fit(
      scratch, separation_margin(scene.separation),
      [&] {
        Moments m{};
        for_each_end([&](const auto* x) { m.add(x); });
        return m;
      },
      [&](const double(&axis)[3][3]) {
        AxesExtent e;
        for_each_end([&](const auto* x) { e.add(axis, x); });
        return e;
      });
  if (lane == 0 && used) {
    leaves[warp] = boxes.leaves[slot] = box;
    boxes.leaf_moments[slot] = scratch.moments[warp];
  }
  __syncthreads();
  if (warp != 0) return;
  const bool in_run = lane < kRun && blockIdx.x * kRun + lane < scene.group_count;
  const Moments run_moments = united_over_warp(in_run ? scratch.moments[lane] : Moments{});
  double axis[3][3];
  principal_axes(run_moments, axis);
  AxesExtent extent;
  if (in_run) extent.add(axis, leaves[lane]);
  const OrientedBox run = enclose(axis, united_over_warp(extent), 0);  // the leaves have the margin
  if (lane != 0) return;
  boxes.runs[blockIdx.x] = run;
  boxes.run_moments[blockIdx.x] = run_moments;
}

__global__ inline void __launch_bounds__(kFitBlock, 1)
    fit_nodes(SceneView scene, OrientedBoxesView boxes) {
  begin_kernel();
  __shared__ FitScratch scratch;
  const int lane = threadIdx.x % kWarp;
  const std::uint32_t node = blockIdx.x * kFitWarps + threadIdx.x / kWarp;
  const int2 range = node < scene.node_count ? scene.node_ranges[node] : int2{0, 0};
  const OrientedBox box = fit(
      scratch, 0,
      [&] {
        Moments m{};
        for_each_part(
            range, lane, [&](int run) { m.add(boxes.run_moments[run]); },
            [&](int slot) { m.add(boxes.leaf_moments[slot]); });
        return m;
      },
      [&](const double(&axis)[3][3]) {
        AxesExtent e;
        for_each_part(
            range, lane, [&](int run) { e.add(axis, load_wide(boxes.runs + run)); },
            [&](int slot) { e.add(axis, load_wide(boxes.leaves + slot)); });
        return e;
      });
  if (lane == 0 && node < scene.node_count)
    boxes.nodes[node] = range.y - range.x == 1 ? boxes.leaves[range.x] : box;
}

}  // namespace lazyccd::gpu
