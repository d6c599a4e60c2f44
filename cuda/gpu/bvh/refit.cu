// Launch of the refit.
#include "gpu/bvh/refit.cuh"

#include "gpu/scene/stages.h"

namespace lazyccd::gpu {
namespace {

template <class Scalar, class Record>
void enqueue_as(const SceneView& scene, const void* start, const void* end, StepCounters* counters,
                cudaStream_t stream) {
  const PositionView<Scalar> positions{static_cast<const Scalar*>(start),
                                       static_cast<const Scalar*>(end)};
  launch_behind(refit_groups<Scalar, Record>,
                run_count(scene) + blocks_for(scene.vertex_count, kRefitBlock), kRefitBlock, 0,
                stream, scene, positions, counters);
  constexpr std::uint32_t block = 128;
  launch_behind(refit_nodes, blocks_for(std::size_t{scene.node_count} * kWarp, block), block, 0,
                stream, scene);
}

__global__ void clear_counters(StepCounters* counters) {
  let_next_kernel_in();
  *counters = {};
}

__global__ void clear_counters_of_pairs(StepCounters* counters) {
  let_next_kernel_in();
  StepCounters kept{};
  kept.bad_positions = counters->bad_positions;
  kept.leaf_area = counters->leaf_area;
  *counters = kept;
}

}  // namespace

void enqueue_start(StepCounters* counters, cudaStream_t stream) {
  clear_counters<<<1, 1, 0, stream>>>(counters);
  LAZYCCD_CUDA_CHECK(cudaGetLastError());
}

void enqueue_restart(StepCounters* counters, cudaStream_t stream) {
  clear_counters_of_pairs<<<1, 1, 0, stream>>>(counters);
  LAZYCCD_CUDA_CHECK(cudaGetLastError());
}

void enqueue_refit(const SceneView& scene, const void* start, const void* end,
                   StepCounters* counters, cudaStream_t stream) {
  if (scene.is_double) {
    enqueue_as<double, DoubleRecord>(scene, start, end, counters, stream);
  } else {
    enqueue_as<float, FloatRecord>(scene, start, end, counters, stream);
  }
}

}  // namespace lazyccd::gpu
