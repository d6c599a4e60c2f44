// Lazy work stealing between blocks: the parts that balance/lazy_stealing.h leaves to the caller.
#pragma once

#include <cstdint>

#include "balance/device_atomics.cuh"
#include "balance/lazy_stealing.h"
#include "gpu/traversal/backoff.cuh"
#include "gpu/traversal/traversal_job.h"
#include "gpu/traversal/traverse.cuh"

namespace lazyccd::gpu {

template <std::uint32_t ChunkSize>
class LazyBlocks {
  // Free chunks that a block keeps for itself. Few, because a block that only steals should not
  // hoard them.
  static constexpr std::uint32_t cache_size = 4;
  using Protocol = LazyStealingWorker<DeviceAtomics, NodePair, ChunkSize, cache_size>;

 public:
  static constexpr bool keeps_time = false;
  struct View {
    LazyStealingView<DeviceAtomics, NodePair, ChunkSize> shared;
    std::uint32_t* last_giver;  // a hint: the block that published last
  };

  /// Resets the counters. The deques are empty and all chunks free, from the last run or from
  /// zeroed memory.
  __device__ static void start(const View& view, const TraversalJob& job) {
    auto& counters = *view.shared.counters;
    counters.live.cell = (initial_count(job) + ChunkSize - 1) / ChunkSize;
    counters.claimed.cell = 0;
    counters.idle_workers.cell = 0;
    counters.cancelled.cell = 0;
    *view.last_giver = 0;
  }

  __device__ void arrive(const View& view, const TraversalJob& job) {
    auto shared = view.shared;
    shared.initial = job.initial;
    shared.initial_count = initial_count(job);
    protocol_.arrive(shared, blockIdx.x);
  }
  __device__ void leave(const View&, const TraversalJob& job) {
    if (threadIdx.x != 0) return;
    protocol_.leave();
    add(job.counters->steals, protocol_.steals());
    add(job.counters->overflows, protocol_.overflows());
  }

  __device__ Batch<NodePair> own_batch() { return protocol_.own_batch(); }
  __device__ void release(const Batch<NodePair>& batch) { protocol_.release_chunk(batch); }

  /// The surplus of a stack leaves, whether another block waits or not. An unused offer costs less
  /// than checking in every round whether a block waits.
  __device__ static std::uint32_t leaving(const StackShape& shape, std::uint32_t size, bool) {
    return size > shape.crowded ? min(shape.batch, size / 2) : 0;
  }
  __device__ bool asked(const View&) const { return false; }
  __device__ Room room(std::uint32_t wanted) {
    chunk_ = protocol_.new_chunk();
    return chunk_ != nullptr ? Room{chunk_->items, wanted} : Room{nullptr, 0};
  }
  __device__ void publish(const View& view, std::uint32_t count) {
    chunk_->count = count;
    protocol_.publish();
    DeviceAtomics::store(*view.last_giver, blockIdx.x, DeviceAtomics::relaxed);  // a hint
  }

  /// Polls until it finds a batch or all is done. A poll is one round trip to L2. It reads some
  /// deques, the deque of the last giver that the poll before found, and the count of remaining
  /// work. All loads are relaxed; the acquire comes with the steal.
  __device__ void wait_for_batch(const View& view, const TraversalJob& job,
                                 Batch<NodePair>& found) {
    const std::uint32_t lane = threadIdx.x % kWarp, workers = view.shared.workers;
    std::uint32_t window = (blockIdx.x + 1) % workers;  // next deques to poll; neighbours differ
    std::uint32_t giver = 0;
    SpinWait waiting;
    for (std::uint32_t poll = 0;; ++poll) {
      random_delay(job);
      std::uint32_t victim = lane == 0 ? giver : (window + lane) % workers;
      const std::uint32_t offers = view.shared.deque(victim).size();
      giver = DeviceAtomics::load(*view.last_giver, DeviceAtomics::relaxed);
      const bool over = view.shared.termination().seems_over();
      if (__all_sync(kAllLanes, over) && view.shared.termination().over()) {
        if (lane == 0) found = {nullptr, 0, no_chunk};
        return;
      }
      const unsigned givers = __ballot_sync(kAllLanes, offers != 0);
      if (givers != 0) {
        // Blocks that poll the same deques should not all pick the same one.
        const unsigned turn = (blockIdx.x + poll) % kWarp;
        const int pick = (__ffs(__funnelshift_r(givers, givers, turn)) - 1 + turn) % kWarp;
        victim = __shfl_sync(kAllLanes, victim, pick);
        bool stolen = false;
        if (lane == 0) {
          const Batch<NodePair> batch = protocol_.steal(victim);
          stolen = batch.count != 0;
          if (stolen) found = batch;
        }
        if (__shfl_sync(kAllLanes, stolen, 0)) return;
      }
      window = (window + kWarp - 1) % workers;
      waiting.pause();
    }
  }

 private:
  Protocol protocol_;
  Chunk<NodePair, ChunkSize>* chunk_;  // the one being filled
};

}  // namespace lazyccd::gpu
