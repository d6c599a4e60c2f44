// Lazy work stealing between blocks as published (da Silva, Algorithms 3.7 to 3.13): the parts that
// research/protocols/greedy_stealing.h leaves to the caller.
#pragma once

#include <cstdint>

#include "balance/device_atomics.cuh"
#include "gpu/traversal/backoff.cuh"
#include "gpu/traversal/traversal_job.h"
#include "gpu/traversal/traverse.cuh"
#include "research/protocols/greedy_stealing.h"

namespace lazyccd::gpu::research {

using namespace lazyccd::research;

class GreedyBlocks {
 public:
  static constexpr bool keeps_time = false;
  static constexpr std::uint32_t batch_size = 256;
  using View = GreedyStealingView<DeviceAtomics, NodePair, batch_size>;

  /// Resets the counters. The deques are empty and all batches free, from the last run or from
  /// zeroed memory.
  __device__ static void start(const View& view, const TraversalJob& job) {
    view.counters->live.cell = (initial_count(job) + batch_size - 1) / batch_size;
    view.counters->claimed.cell = 0;
    view.counters->cancelled.cell = 0;
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

  __device__ Batch<NodePair> own_batch() { return protocol_.own_batch(); }
  __device__ void release(const Batch<NodePair>& batch) { protocol_.release(batch); }

  /// A full stack is emptied to its deque, whether another block waits or not.
  __device__ static std::uint32_t leaving(const StackShape& shape, std::uint32_t size, bool) {
    return size > shape.crowded ? min(shape.batch, size / 2) : 0;
  }
  __device__ bool asked(const View&) const { return false; }
  __device__ Room room(std::uint32_t wanted) {
    filling_ = protocol_.new_batch();
    return filling_ != nullptr ? Room{filling_->items, wanted} : Room{nullptr, 0};
  }
  __device__ void publish(const View&, std::uint32_t count) {
    filling_->count = count;
    protocol_.publish();
  }

  /// Steals a batch from every deque (greedy); each lane has deques of its own. Deques that look
  /// empty are skipped, and several deques are read at once.
  __device__ void wait_for_batch(const View& view, const TraversalJob& job,
                                 Batch<NodePair>& found) {
    constexpr int deques_per_lane = 4;
    const std::uint32_t lane = threadIdx.x % kWarp;
    std::uint32_t won = 0;
    for (SpinWait waiting; won == 0; waiting.pause()) {
      random_delay(job);
      for (std::uint32_t first = 1; first == 1 || first < view.workers;
           first += deques_per_lane * kWarp) {
        if (won == 0 && all_done(view.termination())) {
          if (lane == 0) found = {nullptr, 0, no_chunk};
          return;
        }
        std::uint32_t sizes[deques_per_lane];
        for (int i = 0; i < deques_per_lane; ++i)
          sizes[i] = deque_at(view, first + i * kWarp + lane).size();
        for (int i = 0; i < deques_per_lane; ++i) {
          const std::uint32_t at = first + i * kWarp + lane;
          std::uint32_t batch = no_chunk;
          if (at < view.workers && sizes[i] != 0) batch = deque_at(view, at).steal();
          const unsigned winners = __ballot_sync(kAllLanes, batch != no_chunk);
          if (batch != no_chunk) protocol_.hold(won + __popc(winners & lanes_below(lane)), batch);
          won += __popc(winners);
        }
      }
    }
    __syncwarp();
    if (lane == 0) {
      protocol_.won(won);
      found = protocol_.own_batch();
    }
  }

 private:
  /// Returns the deque of another block; `at` is 1 or more.
  __device__ static Deque<DeviceAtomics> deque_at(const View& view, std::uint32_t at) {
    return view.deque((blockIdx.x + at) % view.workers);
  }

  GreedyStealingWorker<DeviceAtomics, NodePair, batch_size> protocol_;
  Chunk<NodePair, batch_size>* filling_;
};

}  // namespace lazyccd::gpu::research
