#include "gpu/leaf.cuh"

#include "gpu/stages.h"

namespace lazyccd::gpu {

void enqueue_leaf(const SceneView& scene, const LeafPairs& pairs, bool vertex_face, bool edge_edge,
                  const StepLists& lists, cudaStream_t stream) {
  const bool thick = scene.separation > 0;
  const auto kernel =
      scene.is_double ? (thick ? leaf_pairs<DoubleRecord, true> : leaf_pairs<DoubleRecord, false>)
                      : (thick ? leaf_pairs<FloatRecord, true> : leaf_pairs<FloatRecord, false>);
  launch_behind(kernel, kLeafBlocks * multiprocessors(), kLeafWarps * kWarp, 0, stream, scene,
                pairs, vertex_face, edge_edge, lists);
}

}  // namespace lazyccd::gpu
