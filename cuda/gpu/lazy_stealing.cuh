// Lazy work stealing between blocks: what balance/lazy_stealing.h leaves to the caller.
#pragma once

#include <cstdint>

#include "balance/device_atomics.cuh"
#include "balance/lazy_stealing.h"
#include "gpu/traversal_job.h"
#include "gpu/traverse.cuh"

namespace lazyccd::gpu {

template <std::uint32_t ChunkSize>
class LazyBlocks {
  // A block that only takes should not hoard free chunks.
  static constexpr std::uint32_t cache_size = 4;
  using Protocol = LazyStealingWorker<DeviceAtomics, NodePair, ChunkSize, cache_size>;

 public:
  using Chunk = lazyccd::Chunk<NodePair, ChunkSize>;
  static constexpr std::uint32_t chunk_size = ChunkSize;
  struct View {
    LazyStealingView<DeviceAtomics, NodePair, ChunkSize> shared;
    std::uint32_t* last_giver;  // a hint: the block that published last
  };

  // The deques are empty and all chunks free, from the last run or from zeroed memory.
  __device__ static void start(const View& view, const TraversalJob& job) {
    auto& counters = *view.shared.counters;
    counters.live.cell = (initial_count(job) + ChunkSize - 1) / ChunkSize;
    counters.claimed.cell = 0;
    counters.hungry.cell = 0;
    counters.cancelled.cell = 0;
    *view.last_giver = 0;
  }

  __device__ void arrive(const View& view, const TraversalJob& job) {
    auto shared = view.shared;
    shared.initial = job.initial;
    shared.initial_count = initial_count(job);
    protocol_.arrive(shared, blockIdx.x);
  }
  __device__ void leave(const TraversalJob& job) {
    protocol_.leave();
    add(job.counters->steals, protocol_.steals());
    add(job.counters->overflows, protocol_.overflows());
  }

  __device__ Batch<NodePair> own_batch() { return protocol_.own_batch(); }
  __device__ void release(const Batch<NodePair>& batch) { protocol_.release_chunk(batch); }

  __device__ bool wanted(const View& view) const {
    // Relaxed: a hint.
    return DeviceAtomics::load(view.shared.counters->hungry.cell, DeviceAtomics::relaxed) != 0;
  }
  __device__ Chunk* new_chunk(bool full) {
    return full || protocol_.hungry() ? protocol_.new_chunk() : nullptr;
  }
  __device__ void publish(const View& view) {
    protocol_.publish();
    DeviceAtomics::store(*view.last_giver, blockIdx.x, DeviceAtomics::relaxed);  // a hint
  }

  // A warp looks at 31 deques at a time and at that of the last giver. All looks are relaxed: an
  // acquire would empty the L1 cache of a multiprocessor where other blocks still work. The acquire
  // comes with the steal, and with a count of live units that looks like zero.
  __device__ void wait_for_batch(const View& view, const TraversalJob& job, Batch<NodePair>& found) {
    const std::uint32_t lane = threadIdx.x % 32, workers = view.shared.workers;
    std::uint32_t window = (blockIdx.x + 1) % workers;  // where to look next: neighbours differ
    unsigned pause = shortest_pause_ns;
    for (std::uint32_t look = 0;; ++look) {
      std::uint32_t live = 1;
      if (lane == 0) {
        random_delay(job);
        live = DeviceAtomics::load(view.shared.counters->live.cell, DeviceAtomics::relaxed);
        if (live == 0 && !protocol_.over()) live = 1;
      }
      if (__shfl_sync(kAllLanes, live, 0) == 0) {
        if (lane == 0) found = {nullptr, 0, no_chunk};
        return;
      }
      std::uint32_t victim = lane == 31
                                 ? DeviceAtomics::load(*view.last_giver, DeviceAtomics::relaxed)
                                 : (window + lane) % workers;
      const unsigned givers = __ballot_sync(kAllLanes, view.shared.deque(victim).size() != 0);
      if (givers != 0) {
        // Not all who look at the same deques should pick the same one.
        const unsigned turn = (blockIdx.x + look) % 32;
        const int pick = (__ffs(__funnelshift_r(givers, givers, turn)) - 1 + turn) % 32;
        victim = __shfl_sync(kAllLanes, victim, pick);
        bool stolen = false;
        if (lane == 0) {
          const Batch<NodePair> batch = protocol_.steal(victim);
          stolen = batch.count != 0;
          if (stolen) found = batch;
        }
        if (__shfl_sync(kAllLanes, stolen, 0)) return;
      }
      window = (window + 31) % workers;
      __nanosleep(pause);
      pause = min(2 * pause, longest_pause_ns);
    }
  }

 private:
  static constexpr unsigned shortest_pause_ns = 32, longest_pause_ns = 512;

  Protocol protocol_;
};

}  // namespace lazyccd::gpu
