// Oriented boxes of all nodes, fitted in each step. First come the moments of leaves, runs of
// leaves and nodes; then their axes; then the extents along the axes. A leaf is fitted to its
// vertices, a run to its leaves, a node to its runs and leaves. A few lanes work on each volume,
// and none waits for another.
#pragma once

#include "core/narrow/separation.h"
#include "gpu/device/kernel_chain.cuh"
#include "gpu/scene/scene.cuh"
#include "research/gpu_culling/node_parts.cuh"
#include "research/volumes/oriented_box.h"

namespace lazyccd::gpu::research {

/// All volumes in one array: the leaves in their order, then the runs, then the nodes.
struct OrientedBoxesView {
  OrientedBox* boxes;  // of nodes only the axes
  Moments* moments;
  OrientedBoxOf<float>* nodes;
  std::uint32_t first_run, first_node, count;
};

constexpr int kFitLanes = 16;                          // per volume: most nodes have few parts
constexpr std::uint32_t kFitBlock = kRun * kFitLanes;  // threads of a block: the leaves of a run

/// Returns the index of the volume that this thread works on.
__device__ inline std::uint32_t fitted_volume() {
  return (blockIdx.x * blockDim.x + threadIdx.x) / kFitLanes;
}
/// Returns the index of this thread among the lanes of its volume.
__device__ inline int fit_lane() { return static_cast<int>(threadIdx.x % kFitLanes); }

/// Unites moments over the lanes of each volume. All lanes of the warp must call it.
__device__ inline Moments united(Moments m) {
  for (int offset = kFitLanes / 2; offset > 0; offset /= 2) {
    m.count += __shfl_xor_sync(kAllLanes, m.count, offset);
    for (double& x : m.sum) x += __shfl_xor_sync(kAllLanes, x, offset);
    for (double& x : m.product) x += __shfl_xor_sync(kAllLanes, x, offset);
  }
  return m;
}

/// Unites extents over the lanes of each volume. All lanes of the warp must call it.
__device__ inline AxesExtent united(AxesExtent e) {
  for (int offset = kFitLanes / 2; offset > 0; offset /= 2) {
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

/// Calls f(position) for the lane's share of the positions of a leaf's vertices, at both ends of
/// the step. A vertex of several cells comes more than once.
template <class Record, class F>
__device__ inline void for_each_position(const SceneView& scene, std::uint32_t slot, F&& f) {
  if (slot >= scene.group_count) return;
  const Record* records = static_cast<const Record*>(scene.records);
  for_each_cell<kFitLanes>(scene.groups, scene.leaf_order[slot], fit_lane(),
                           [&](const PrimitiveNames& cell) {
                             for (int k = 0; k < 3 && cell.vertex[k] >= 0; ++k) {
                               const Record record = load_wide(records + cell.vertex[k]);
                               f(record.x);
                               f(record.x + 3);
                             }
                           });
}

/// Calls f(leaf) for the lane's share of a run's leaves, counted from the run's first leaf.
template <class F>
__device__ inline void for_each_leaf_of_run(const SceneView& scene, F&& f) {
  for (int leaf = fit_lane(); leaf < kRun && blockIdx.x * kRun + leaf < scene.group_count;
       leaf += kFitLanes)
    f(leaf);
}

/// Computes the moments of leaves and runs; one block per run.
template <class Record>
__global__ void sum_leaves(SceneView scene, OrientedBoxesView view) {
  begin_kernel();
  __shared__ Moments leaves[kRun];
  const std::uint32_t slot = fitted_volume();
  Moments m{};
  for_each_position<Record>(scene, slot, [&](const auto* x) { m.add(x); });
  m = united(m);
  if (fit_lane() == 0) {
    leaves[threadIdx.x / kFitLanes] = m;
    if (slot < scene.group_count) view.moments[slot] = m;
  }
  __syncthreads();
  if (threadIdx.x >= kWarp) return;
  m = {};
  for_each_leaf_of_run(scene, [&](int leaf) { m.add(leaves[leaf]); });
  m = united(m);
  if (threadIdx.x == 0) view.moments[view.first_run + blockIdx.x] = m;
}

/// Computes the moments of the nodes.
__global__ void sum_nodes(SceneView scene, OrientedBoxesView view) {
  begin_kernel();
  const std::uint32_t node = fitted_volume();
  const int2 range = node < scene.node_count ? scene.node_ranges[node] : int2{0, 0};
  Moments m{};
  for_each_part<kFitLanes>(
      range, fit_lane(), [&](int run) { m.add(view.moments[view.first_run + run]); },
      [&](int slot) { m.add(view.moments[slot]); });
  m = united(m);
  if (fit_lane() == 0 && node < scene.node_count) view.moments[view.first_node + node] = m;
}

/// Computes the principal axes of all volumes; one thread per volume.
__global__ void find_axes(OrientedBoxesView view) {
  begin_kernel();
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < view.count) principal_axes(view.moments[i], view.boxes[i].axis);
}

/// The axes of a volume.
struct Axes {
  double axis[3][3] = {};

  __device__ void load(const OrientedBox& box) {
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) axis[i][k] = box.axis[i][k];
  }
};

/// Fits the boxes of leaves and runs; one block per run.
template <class Record>
__global__ void fit_leaves(SceneView scene, OrientedBoxesView view) {
  begin_kernel();
  __shared__ OrientedBox leaves[kRun];
  const std::uint32_t slot = fitted_volume();
  const bool used = slot < scene.group_count;
  {
    Axes axes;
    if (used) axes.load(view.boxes[slot]);
    AxesExtent extent;
    for_each_position<Record>(scene, slot, [&](const auto* x) { extent.add(axes.axis, x); });
    extent = united(extent);
    if (fit_lane() == 0 && used)
      view.boxes[slot] = leaves[threadIdx.x / kFitLanes] =
          enclose(axes.axis, extent, separation_margin(scene.separation.between_bodies));
  }
  __syncthreads();
  if (threadIdx.x >= kWarp) return;
  OrientedBox& run = view.boxes[view.first_run + blockIdx.x];
  Axes axes;
  axes.load(run);
  AxesExtent extent;
  for_each_leaf_of_run(scene, [&](int leaf) { extent.add(axes.axis, leaves[leaf]); });
  extent = united(extent);
  __syncwarp();                                               // all have read the axes
  if (threadIdx.x == 0) run = enclose(axes.axis, extent, 0);  // the leaves include the margin
}

/// Fits the boxes of the nodes.
__global__ void fit_nodes(SceneView scene, OrientedBoxesView view) {
  begin_kernel();
  const std::uint32_t node = fitted_volume();
  const bool used = node < scene.node_count;
  Axes axes;
  if (used) axes.load(view.boxes[view.first_node + node]);
  AxesExtent extent;
  for_each_part<kFitLanes>(
      used ? scene.node_ranges[node] : int2{0, 0}, fit_lane(),
      [&](int run) { extent.add(axes.axis, load_wide(view.boxes + view.first_run + run)); },
      [&](int slot) { extent.add(axes.axis, load_wide(view.boxes + slot)); });
  extent = united(extent);
  if (fit_lane() == 0 && used) view.nodes[node] = rounded(enclose(axes.axis, extent, 0));
}

}  // namespace lazyccd::gpu::research
