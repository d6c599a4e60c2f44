// Lazy work stealing with culling of nodes.
#include "gpu/traversal/lazy_traversal.cuh"
#include "research/gpu_culling/node_culling.cuh"
#include "research/gpu_strategies/strategies.h"

namespace lazyccd::gpu::research {

std::unique_ptr<TraversalStrategy> make_culling_lazy_stealing(const Tuning& tuning) {
  return make_lazy_traversal<NodeCulling>(tuning);
}

}  // namespace lazyccd::gpu::research
