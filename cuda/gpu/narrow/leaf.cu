// Launch of the leaf kernel.
#include "gpu/narrow/leaf.cuh"

#include "gpu/scene/stages.h"

namespace lazyccd::gpu {
namespace {

template <class Record, bool has_separation>
auto kernel(bool culls) {
  return culls ? leaf_pairs<Record, has_separation, true>
               : leaf_pairs<Record, has_separation, false>;
}

}  // namespace

void enqueue_leaf(const SceneView& scene, const LeafPairs& pairs, bool vertex_face, bool edge_edge,
                  bool culls, const LeafCulling& culling, const StepLists& lists,
                  cudaStream_t stream) {
  const bool has_separation = scene.separation.between_bodies > 0;
  const auto chosen = scene.is_double ? (has_separation ? kernel<DoubleRecord, true>(culls)
                                                        : kernel<DoubleRecord, false>(culls))
                                      : (has_separation ? kernel<FloatRecord, true>(culls)
                                                        : kernel<FloatRecord, false>(culls));
  const int blocks = scene.is_double ? kLeafBlocks<DoubleRecord> : kLeafBlocks<FloatRecord>;
  launch_behind(chosen, static_cast<std::uint32_t>(blocks) * multiprocessors(), kLeafWarps * kWarp,
                0, stream, scene, pairs, vertex_face, edge_edge, lists, culling);
}

}  // namespace lazyccd::gpu
