#include "gpu/refit.cuh"

#include "gpu/stages.h"

namespace lazyccd::gpu {
namespace {

template <class Scalar, class Record>
void enqueue_as(const SceneView& scene, const void* start, const void* end, StepCounters* counters,
                cudaStream_t stream) {
  constexpr std::uint32_t block = 128;
  const auto warps = [](std::size_t count) { return blocks_for(count * kWarp, block); };
  load_positions<Scalar, Record><<<blocks_for(scene.vertex_count, block), block, 0, stream>>>(
      scene, static_cast<const Scalar*>(start), static_cast<const Scalar*>(end), counters);
  LAZYCCD_CUDA_CHECK(cudaGetLastError());
  launch_behind(refit_groups<Record>, blocks_for(scene.group_count, kRun), kRefitBlock, 0, stream,
                scene, counters);
  launch_behind(refit_nodes, warps(scene.node_count), block, 0, stream, scene);
}

}  // namespace

void enqueue_refit(const SceneView& scene, const void* start, const void* end,
                   StepCounters* counters, cudaStream_t stream) {
  if (scene.is_double) {
    enqueue_as<double, DoubleRecord>(scene, start, end, counters, stream);
  } else {
    enqueue_as<float, FloatRecord>(scene, start, end, counters, stream);
  }
}

}  // namespace lazyccd::gpu
