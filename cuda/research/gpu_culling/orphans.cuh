// Orphan sets on the device. The leaf kernel drops the pairs that are in the sets. A kernel of
// their own filters them into the same lists.
#pragma once

#include "gpu/narrow/query.cuh"
#include "research/culling/orphan_list.h"
#include "research/gpu_culling/node_culling.cuh"

namespace lazyccd::gpu::research {

/// A filter of the leaf kernel that drops orphans, because filter_orphans() tests them.
struct OrphanFilter {
  static constexpr bool drops_any = true;

  bool non_penetration;   // the non-penetration filter is on
  OrphanList orphans[2];  // by ContactKind

  /// Returns whether to drop a candidate, because it is an orphan.
  __device__ bool drops(ContactKind kind, Candidate pair) const {
    return orphans[static_cast<int>(kind)].contains(kind, pair);
  }
};

/// Returns whether the first `split` of four vertices stay on one side of the others along an axis:
/// at both ends of the step, and so at all times.
template <int split, class Record>
__device__ inline bool apart_along_axis(const Record (&p)[4]) {
  for (int k = 0; k < 3; ++k) {
    bool below = true, above = true;
    for (int end = 0; end < 2; ++end) {
      for (int i = 0; i < split; ++i) {
        for (int j = split; j < 4; ++j) {
          below = below && p[i].x[3 * end + k] < p[j].x[3 * end + k];
          above = above && p[i].x[3 * end + k] > p[j].x[3 * end + k];
        }
      }
    }
    if (below || above) return true;
  }
  return false;
}

/// Returns whether an orphan pair may touch, in a step that detects its body. Both primitives
/// belong to one body, because their faces share a vertex.
template <ContactKind kind, class Record>
__device__ inline bool may_touch(const SceneView& scene, Candidate pair) {
  Contact contact;
  identify_contact<kind>(scene.mesh, pair, contact);
  if (!scene.detects(contact.body_a)) return false;
  if (!scene.groups.bodies[contact.body_a].self_collision) return false;
  Record p[4];
  for (int i = 0; i < 4; ++i)
    p[i] = load_wide(static_cast<const Record*>(scene.records) + contact.vertices[i]);
  constexpr int split = kind == ContactKind::vertex_face ? 1 : 2;
  return !apart_along_axis<split>(p);
}

/// Filters the orphans of one kind.
template <ContactKind kind, class Record>
__device__ inline void filter_orphans_of(const SceneView& scene, const OrphanFilter& culling,
                                         const StepLists& lists, CullingCounters& counters) {
  constexpr int k = static_cast<int>(kind);
  const OrphanList& orphans = culling.orphans[k];
  const float scale = static_cast<float>(scene_scale(scene));
  const int lane = threadIdx.x % kWarp;
  std::uint32_t near = 0;
  // Whole warps stay in the loop to the end of the list.
  for (std::uint32_t base = blockIdx.x * blockDim.x; base < orphans.count;
       base += gridDim.x * blockDim.x) {
    const std::uint32_t i = base + threadIdx.x;
    const Candidate pair = orphans.pairs[min(i, orphans.count - 1)];
    bool survives = i < orphans.count && may_touch<kind, Record>(scene, pair);
    near += __popc(__ballot_sync(kAllLanes, survives));
    if (culling.non_penetration && survives) {
      const Differences<float> d = gather<kind, Record>(scene, pair, scale);
      survives = !coplanarity(d, magnitudes(d)).no_root();
    }
    append_lanes(lists.filtered[k], survives, pair, lane);
  }
  if (lane != 0 || near == 0) return;
  add_to(lists.counters->candidates[k], near);
  atomicAdd(&counters.orphans, near);
}

/// Filters the orphans into the lists of filtered candidates.
template <class Record>
__global__ void filter_orphans(SceneView scene, OrphanFilter culling, bool vertex_face,
                               bool edge_edge, StepLists lists, CullingCounters* counters) {
  begin_kernel();
  if (vertex_face)
    filter_orphans_of<ContactKind::vertex_face, Record>(scene, culling, lists, *counters);
  if (edge_edge)
    filter_orphans_of<ContactKind::edge_edge, Record>(scene, culling, lists, *counters);
}

}  // namespace lazyccd::gpu::research
