#include "gpu/traversal/lazy_traversal.cuh"

namespace lazyccd::gpu {

std::unique_ptr<TraversalStrategy> make_lazy_stealing(const Tuning& tuning) {
  return make_lazy_traversal<NoCulling>(tuning);
}

}  // namespace lazyccd::gpu
