// Launch of the exact stage.
#include "gpu/narrow/exact.cuh"

#include "gpu/scene/stages.h"

namespace lazyccd::gpu {

void enqueue_exact(const SceneView& scene, const StepLists& lists, bool many, cudaStream_t stream) {
  // A warp per query, each with much work.
  const std::uint32_t blocks = many ? 4 * multiprocessors() : (multiprocessors() + 3) / 4;
  if (scene.is_double) {
    launch_behind(decide_exactly<DoubleRecord>, blocks, kDecideThreads, 0, stream, scene, lists);
  } else {
    launch_behind(decide_exactly<FloatRecord>, blocks, kDecideThreads, 0, stream, scene, lists);
  }
}

}  // namespace lazyccd::gpu
