// Continuous normal cones with the contour condition (research/culling/normal_cone.h) on the
// device. They decide, for all nodes and before the traversal, which nodes cannot touch themselves.
#pragma once

#include "gpu/device/kernel_chain.cuh"
#include "gpu/scene/scene.cuh"
#include "research/culling/normal_cone.h"
#include "research/gpu_culling/node_culling.cuh"
#include "research/gpu_culling/node_parts.cuh"

namespace lazyccd::gpu::research {

struct NormalConesView {
  const NodePatch* patches;
  const std::int32_t* vertices;  // vertices of all boundaries
  Directions* leaves;            // cones of the leaves, in leaf order
  unsigned char* flat;           // out, per node; set for the nodes that are patches
};

/// Returns the intersection of the sets over a warp.
__device__ inline Directions common_to_warp(Directions d) {
  for (int offset = kWarp / 2; offset > 0; offset /= 2) d &= __shfl_xor_sync(kAllLanes, d, offset);
  return d;
}

/// Computes the cones of the leaves; one warp per leaf.
template <class Record>
__global__ void find_cones(SceneView scene, NormalConesView cones) {
  begin_kernel();
  const std::uint32_t slot = (blockIdx.x * blockDim.x + threadIdx.x) / kWarp;
  const int lane = threadIdx.x % kWarp;
  if (slot >= scene.group_count) return;
  const Record* records = static_cast<const Record*>(scene.records);
  Directions directions = ~Directions{0};
  for_each_cell<kWarp>(scene.groups, scene.leaf_order[slot], lane, [&](const PrimitiveNames& face) {
    if (face.vertex[2] < 0) return;
    const Record a = load_wide(records + face.vertex[0]), b = load_wide(records + face.vertex[1]),
                 c = load_wide(records + face.vertex[2]);
    directions &= views_of_face(a.x, b.x, c.x);
  });
  directions = common_to_warp(directions);
  if (lane == 0) cones.leaves[slot] = directions;
}

constexpr int kLoopWarps = 8;  // per boundary
constexpr std::uint32_t kLoopBlock = kLoopWarps * kWarp;

/// The boundary of a patch: one closed loop of vertices. Indices may run up to twice its length.
template <class Record>
struct BoundaryLoop {
  const Record* records;
  const std::int32_t* vertices;
  int count;

  __device__ Record operator[](int i) const {
    return load_wide(records + vertices[i < count ? i : i - count]);
  }

  /// Returns whether the loop never meets itself, apart from the vertex that two neighbouring sides
  /// share. By a block. Each side is tested against the sides from the next but one up to half way
  /// round, of which each warp takes a part.
  __device__ bool simple(const View& view) const {
    const int lane = threadIdx.x % kWarp, warp = threadIdx.x / kWarp;
    double size = 0;
    for (int i = lane; i < count; i += kWarp) {
      const Record record = (*this)[i];
      for (int k = 0; k < 6; ++k) size = lane_max(size, fabs(static_cast<double>(record.x[k])));
    }
    for (int offset = kWarp / 2; offset > 0; offset /= 2)
      size = lane_max(size, __shfl_xor_sync(kAllLanes, size, offset));
    const Contour contour(view, size);
    const int last = count / 2 + 1, part = (last - 2 + kLoopWarps - 1) / kLoopWarps;
    const int first = min(2 + warp * part, last);
    for (int base = 0; base < count; base += kWarp) {
      const int i = base + lane;
      const bool good = i >= count || ((warp != 0 || turns(contour, i)) &&
                                       free(contour, i, first, min(first + part, last)));
      if (!__syncthreads_and(good)) return false;
    }
    return true;
  }

 private:
  __device__ Contour::Seen seen(const Contour& contour, int i) const {
    return contour.seen((*this)[i].x);
  }
  __device__ bool turns(const Contour& contour, int i) const {
    return contour.turns(seen(contour, i), seen(contour, i + 1), seen(contour, i + 2));
  }
  /// Returns whether side i is apart from the sides i + first to i + last - 1.
  __device__ bool free(const Contour& contour, int i, int first, int last) const {
    if (first >= last) return true;
    const Contour::Side side(seen(contour, i), seen(contour, i + 1));
    Contour::Seen from = seen(contour, i + first);
    for (int step = first; step < last; ++step) {
      const Contour::Seen to = seen(contour, i + step + 1);
      if (!contour.apart(side, Contour::Side(from, to))) return false;
      from = to;
    }
    return true;
  }
};

/// Decides which patches cannot touch themselves; one block per patch.
template <class Record>
__global__ void __launch_bounds__(kLoopBlock)
    find_flat_nodes(SceneView scene, NormalConesView cones) {
  begin_kernel();
  const NodePatch patch = cones.patches[blockIdx.x];
  const int2 range = scene.node_ranges[patch.node];
  Directions cone = ~Directions{0};
  for (int slot = range.x + threadIdx.x % kWarp; slot < range.y; slot += kWarp)
    cone &= cones.leaves[slot];
  const int seen_along = view_of(common_to_warp(cone));
  const BoundaryLoop<Record> loop{static_cast<const Record*>(scene.records),
                                  cones.vertices + patch.first, static_cast<int>(patch.count)};
  const bool flat = seen_along >= 0 && loop.simple(view(seen_along));
  if (threadIdx.x == 0) cones.flat[patch.node] = flat;
}

}  // namespace lazyccd::gpu::research
