// The diagonals of all nodes' 18-DOPs, recomputed in each step from the groups' diagonals.
#pragma once

#include "gpu/bvh/extents.cuh"
#include "gpu/device/kernel_chain.cuh"
#include "gpu/scene/scene.cuh"
#include "research/gpu_culling/node_culling.cuh"
#include "research/gpu_culling/node_parts.cuh"

namespace lazyccd::gpu::research {

__device__ inline NodeDiagonals no_diagonals() {
  NodeDiagonals d;
  for (AxisExtent& e : d.axis) e = empty_extent();
  return d;
}

__device__ inline void unite(NodeDiagonals& a, const AxisExtent* b) {
  for (int k = 0; k < kDiagonals; ++k) unite(a.axis[k], load_wide(b + k));
}

/// Unites the diagonals over a warp and stores them; lane k stores the k-th.
__device__ inline void store_united(const NodeDiagonals& d, NodeDiagonals& place, int lane) {
  for (int k = 0; k < kDiagonals; ++k) {
    const AxisExtent e = united_over_warp(d.axis[k]);
    if (lane == k) place.axis[k] = e;
  }
}

/// Adds the diagonals of the leaf at `slot` of the leaf order.
__device__ inline void unite_leaf(NodeDiagonals& d, const SceneView& scene, int slot) {
  unite(d, scene.groups.bounds[scene.leaf_order[slot]].axis + kSides);
}

/// Computes the diagonals of the runs; one warp per run.
__global__ void unite_runs(SceneView scene, NodeDiagonals* runs) {
  begin_kernel();
  const std::uint32_t run = (blockIdx.x * blockDim.x + threadIdx.x) / kWarp;
  const int lane = threadIdx.x % kWarp;
  if (run * kRun >= scene.group_count) return;
  NodeDiagonals d = no_diagonals();
  if (lane < kRun && run * kRun + lane < scene.group_count)
    unite_leaf(d, scene, static_cast<int>(run * kRun) + lane);
  store_united(d, runs[run], lane);
}

/// Computes the diagonals of the nodes; one warp per node.
__global__ void unite_nodes(SceneView scene, const NodeDiagonals* runs, NodeDiagonals* nodes) {
  begin_kernel();
  const std::uint32_t node = (blockIdx.x * blockDim.x + threadIdx.x) / kWarp;
  const int lane = threadIdx.x % kWarp;
  if (node >= scene.node_count) return;
  NodeDiagonals d = no_diagonals();
  for_each_part<kWarp>(
      scene.node_ranges[node], lane, [&](int run) { unite(d, runs[run].axis); },
      [&](int slot) { unite_leaf(d, scene, slot); });
  store_united(d, nodes[node], lane);
}

}  // namespace lazyccd::gpu::research
