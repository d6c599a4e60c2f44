// Launch of the leaf kernel.
#include "gpu/narrow/leaf.cuh"

#include "gpu/scene/stages.h"

namespace lazyccd::gpu {

void enqueue_leaf(const SceneView& scene, const LeafPairs& pairs, bool vertex_face, bool edge_edge,
                  bool non_penetration, const StepLists& lists, cudaStream_t stream) {
  if (non_penetration) {
    enqueue_leaf_kernel(scene, pairs, vertex_face, edge_edge, LeafFilter<true>{}, lists, stream);
  } else {
    enqueue_leaf_kernel(scene, pairs, vertex_face, edge_edge, LeafFilter<false>{}, lists, stream);
  }
}

}  // namespace lazyccd::gpu
