// Launch of the narrow phase.
#include "gpu/narrow/narrow.cuh"

#include "gpu/scene/stages.h"

namespace lazyccd::gpu {
namespace {

template <class Record>
void enqueue_as(const SceneView& scene, const StepLists& lists, cudaStream_t stream) {
  const std::uint32_t grid = multiprocessors();
  if (scene.separation.between_bodies > 0) {
    launch_behind(decide_within<Record>, 4 * grid, 128, 0, stream, scene, lists);
    return;
  }
  const DirectSubdivision direct{2 * kDecideBlocks * grid * kDecideThreads / kWarp};
  launch_behind(filter_at_roots<Record>, 6 * grid / 4 * 4, 128, 0, stream, scene, lists, direct);
  launch_behind(decide<Record>, kDecideBlocks * grid, kDecideThreads, 0, stream, scene, lists,
                direct);
}

}  // namespace

void enqueue_narrow(const SceneView& scene, const StepLists& lists, cudaStream_t stream) {
  if (scene.is_double) {
    enqueue_as<DoubleRecord>(scene, lists, stream);
  } else {
    enqueue_as<FloatRecord>(scene, lists, stream);
  }
}

}  // namespace lazyccd::gpu
