// Continuous normal cones with the contour condition (core/normal_cone.h) on the device: which
// nodes are apart from themselves, decided for all of them before the traversal.
#pragma once

#include "core/normal_cone.h"
#include "gpu/kernel_chain.cuh"
#include "gpu/node_parts.cuh"
#include "gpu/scene.cuh"

namespace lazyccd::gpu {

struct NormalConesView {
  const uint2* boundaries;       // of each node: the first of its boundary's vertices, and how many
  const std::int32_t* vertices;  // of all boundaries
  Directions* leaves;            // cones of the leaves in their order
  unsigned char* flat;           // out, by node
};

__device__ inline Directions common_to_warp(Directions d) {
  for (int offset = kWarp / 2; offset > 0; offset /= 2) d &= __shfl_xor_sync(kAllLanes, d, offset);
  return d;
}

// One warp a leaf.
template <class Record>
__global__ void find_cones(SceneView scene, NormalConesView cones) {
  begin_kernel();
  const std::uint32_t slot = (blockIdx.x * blockDim.x + threadIdx.x) / kWarp;
  const int lane = threadIdx.x % kWarp;
  if (slot >= scene.group_count) return;
  const Record* records = static_cast<const Record*>(scene.records);
  Directions directions = ~Directions{0};
  for_each_cell(scene.groups, scene.leaf_order[slot], lane, [&](const PrimitiveNames& face) {
    if (face.vertex[2] < 0) return;
    const Record a = load_wide(records + face.vertex[0]), b = load_wide(records + face.vertex[1]),
                 c = load_wide(records + face.vertex[2]);
    directions &= views_of_face(a.x, b.x, c.x);
  });
  directions = common_to_warp(directions);
  if (lane == 0) cones.leaves[slot] = directions;
}

// The boundary of a patch: one loop of vertices. Indices go round it once more.
template <class Record>
struct BoundaryLoop {
  const Record* records;
  const std::int32_t* vertices;
  int count;

  __device__ Record operator[](int i) const {
    return load_wide(records + vertices[i < count ? i : i - count]);
  }

  // Whether two sides of the loop meet nowhere but in the vertex of neighbours, by a warp: each
  // side with those from the next but one up to half way round.
  __device__ bool simple(const View& view, int lane) const {
    double size = 0;
    for (int i = lane; i < count; i += kWarp) {
      const Record record = (*this)[i];
      for (int k = 0; k < 6; ++k) size = lane_max(size, fabs(static_cast<double>(record.x[k])));
    }
    for (int offset = kWarp / 2; offset > 0; offset /= 2)
      size = lane_max(size, __shfl_xor_sync(kAllLanes, size, offset));
    const Contour contour(view, size);
    for (int base = 0; base < count; base += kWarp) {
      const int i = base + lane;
      const bool good = i >= count || side_is_free(contour, i);
      if (!__all_sync(kAllLanes, good)) return false;
    }
    return true;
  }

 private:
  __device__ bool side_is_free(const Contour& contour, int i) const {
    const Contour::Seen a = contour.seen((*this)[i].x), b = contour.seen((*this)[i + 1].x);
    Contour::Seen from = contour.seen((*this)[i + 2].x);
    if (!contour.turns(a, b, from)) return false;
    const Contour::Side side(a, b);
    for (int step = 2; step <= count / 2; ++step) {
      const Contour::Seen to = contour.seen((*this)[i + step + 1].x);
      if (!contour.apart(side, Contour::Side(from, to))) return false;
      from = to;
    }
    return true;
  }
};

// One warp a node.
template <class Record>
__global__ void find_flat_nodes(SceneView scene, NormalConesView cones) {
  begin_kernel();
  const std::uint32_t node = (blockIdx.x * blockDim.x + threadIdx.x) / kWarp;
  const int lane = threadIdx.x % kWarp;
  if (node >= scene.node_count) return;
  const uint2 boundary = cones.boundaries[node];
  bool flat = false;
  if (boundary.y != 0) {
    const int2 range = scene.node_ranges[node];
    Directions cone = ~Directions{0};
    for (int slot = range.x + lane; slot < range.y; slot += kWarp) cone &= cones.leaves[slot];
    const int seen_along = view_of(common_to_warp(cone));
    const BoundaryLoop<Record> loop{static_cast<const Record*>(scene.records),
                                    cones.vertices + boundary.x, static_cast<int>(boundary.y)};
    flat = seen_along >= 0 && loop.simple(view(seen_along), lane);
  }
  if (lane == 0) cones.flat[node] = flat;
}

}  // namespace lazyccd::gpu
