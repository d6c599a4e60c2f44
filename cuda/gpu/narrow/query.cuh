// Elementary queries on the device: loading their points, and appending their results to lists.
#pragma once

#include "core/narrow/elementary.h"
#include "gpu/device/kernel_chain.cuh"
#include "gpu/scene/scene.cuh"

namespace lazyccd::gpu {

/// Returns a power of two that scales all differences of positions to at most 2^6
/// (core/narrow/elementary.h). Computed from the box of the root.
__device__ inline double scene_scale(const SceneView& scene) {
  const TreeNode& root = scene.nodes[0];
  float size = 0;
  for (int k = 0; k < 3; ++k) size = fmaxf(size, root.hi[k] - root.lo[k]);
  if (!(size > 0)) return 1;
  const int exponent = 5 - ilogbf(size);
  return ldexp(1.0, exponent < -120 ? -120 : exponent > 120 ? 120 : exponent);
}

__device__ inline Vec3<float> scaled_difference(const FloatRecord& a, const FloatRecord& b, int end,
                                                float scale) {
  // Rounded once: as accurate as the difference in double, rounded to float.
  return {scale * (b.x[3 * end] - a.x[3 * end]), scale * (b.x[3 * end + 1] - a.x[3 * end + 1]),
          scale * (b.x[3 * end + 2] - a.x[3 * end + 2])};
}

__device__ inline Vec3<float> scaled_difference(const DoubleRecord& a, const DoubleRecord& b,
                                                int end, float scale) {
  const double s = scale;
  return {static_cast<float>(s * (b.x[3 * end] - a.x[3 * end])),
          static_cast<float>(s * (b.x[3 * end + 1] - a.x[3 * end + 1])),
          static_cast<float>(s * (b.x[3 * end + 2] - a.x[3 * end + 2]))};
}

/// Loads the differences of a query with the points a, b, c, d. Vertex-face: the corners of the
/// face, then the vertex. Edge-edge: the ends of one edge, then the ends of the other in reverse
/// order.
template <ContactKind kind, class Record>
__device__ inline Differences<float> gather_points(const SceneView& scene, std::int32_t a,
                                                   std::int32_t b, std::int32_t c, std::int32_t d,
                                                   float scale) {
  const Record* records = static_cast<const Record*>(scene.records);
  const Record p[4] = {load_wide(records + a), load_wide(records + b), load_wide(records + c),
                       load_wide(records + d)};
  Differences<float> result;
  for (int end = 0; end < 2; ++end) {
    result.e1[end] = scaled_difference(p[0], p[1], end, scale);
    result.e2[end] =
        scaled_difference(kind == ContactKind::vertex_face ? p[0] : p[3], p[2], end, scale);
    result.r[end] = scaled_difference(p[0], p[3], end, scale);
  }
  return result;
}

/// Loads the differences of a candidate.
template <ContactKind kind, class Record>
__device__ inline Differences<float> gather(const SceneView& scene, Candidate c, float scale) {
  if constexpr (kind == ContactKind::vertex_face) {
    const std::int32_t* f = scene.mesh.faces[c.b];
    return gather_points<kind, Record>(scene, f[0], f[1], f[2], c.a, scale);
  } else {
    const int2 a = reinterpret_cast<const int2*>(scene.mesh.edges)[c.a];
    const int2 b = reinterpret_cast<const int2*>(scene.mesh.edges)[c.b];
    return gather_points<kind, Record>(scene, a.x, a.y, b.y, b.x, scale);
  }
}

/// Adds to a counter of 64 bits.
__device__ inline void add_to(std::uint64_t& counter, std::uint64_t value) {
  atomicAdd(reinterpret_cast<unsigned long long*>(&counter),
            static_cast<unsigned long long>(value));
}

/// Appends the items of the lanes that want it, with one atomic operation per warp. All lanes must
/// call it. Items beyond the capacity are counted and dropped.
template <class T>
__device__ inline void append_lanes(const Output<T>& output, bool wanted, const T& item, int lane) {
  const unsigned mask = __ballot_sync(kAllLanes, wanted);
  if (mask == 0) return;
  std::uint32_t first = 0;
  if (lane == 0) first = atomicAdd(output.count, __popc(mask));
  first = __shfl_sync(kAllLanes, first, 0);
  const std::uint32_t slot = first + __popc(mask & lanes_below(lane));
  if (wanted && slot < output.capacity) output.items[slot] = item;
}

}  // namespace lazyccd::gpu
