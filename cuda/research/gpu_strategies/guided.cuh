// Guided self-scheduling between blocks: the parts that research/protocols/guided.h leaves to the
// caller.
#pragma once

#include <cstdint>

#include "balance/device_atomics.cuh"
#include "gpu/traversal/backoff.cuh"
#include "gpu/traversal/traversal_job.h"
#include "gpu/traversal/traverse.cuh"
#include "research/protocols/guided.h"

namespace lazyccd::gpu::research {

using namespace lazyccd::research;

class GuidedBlocks {
 public:
  static constexpr bool keeps_time = false;
  using View = GuidedView<DeviceAtomics, NodePair>;

  /// Resets the counters. All lists have been read, in the last run or because memory is zeroed.
  __device__ static void start(const View& view, const TraversalJob& job) {
    *view.counters = {};
    view.counters->live.cell = initial_count(job) != 0;
  }

  __device__ void arrive(const View& view, const TraversalJob& job) {
    View shared = view;
    shared.initial = job.initial;
    shared.initial_count = initial_count(job);
    protocol_.arrive(shared, blockIdx.x);
  }
  __device__ void leave(const View&, const TraversalJob& job) {
    if (threadIdx.x != 0) return;
    add(job.counters->steals, protocol_.steals());
    add(job.counters->overflows, protocol_.overflows());
  }

  __device__ Batch<NodePair> own_batch() { return protocol_.claim(); }
  __device__ void release(const Batch<NodePair>& batch) { protocol_.release(batch); }

  __device__ static std::uint32_t leaving(const StackShape& shape, std::uint32_t size, bool asked) {
    return asked && size > shape.keep ? min(shape.batch, size / 2) : 0;
  }
  __device__ bool asked(const View&) const { return protocol_.asked(); }
  __device__ Room room(std::uint32_t wanted) {
    NodePair* const list = protocol_.new_list();
    return {list, list != nullptr ? wanted : 0};
  }
  __device__ void publish(const View&, std::uint32_t count) { protocol_.publish(count); }

  __device__ void wait_for_batch(const View& view, const TraversalJob& job,
                                 Batch<NodePair>& found) {
    const std::uint32_t lane = threadIdx.x % kWarp;
    for (SpinWait waiting;; waiting.pause()) {
      random_delay(job);
      std::uint32_t count = 0;
      if (lane == 0) {
        found = protocol_.claim();
        count = found.count;
      }
      if (__shfl_sync(kAllLanes, count, 0) != 0 || all_done(view.termination())) return;
    }
  }

 private:
  GuidedWorker<DeviceAtomics, NodePair> protocol_;
};

}  // namespace lazyccd::gpu::research
