// Task stealing between blocks: the parts that research/protocols/task_deque.h leaves to the
// caller. A block's pairs go through its deque, apart from the pairs that it tests next. The lanes
// of an idle block's first warp steal in parallel, one task each.
#pragma once

#include <cstdint>

#include "balance/device_atomics.cuh"
#include "balance/portions.h"
#include "gpu/traversal/backoff.cuh"
#include "gpu/traversal/traversal_job.h"
#include "gpu/traversal/traverse.cuh"
#include "research/protocols/task_deque.h"

namespace lazyccd::gpu::research {

using namespace lazyccd::research;

class TaskBlocks {
 public:
  static constexpr bool keeps_time = false;
  using Age = std::uint64_t;
  struct Counters {
    // Initial pairs that blocks have taken, or more.
    alignas(DeviceAtomics::line) std::uint64_t claimed;
    // For Termination: the number of busy blocks and of portions of the initial pairs.
    alignas(DeviceAtomics::line) std::uint32_t live;
  };
  struct View {
    std::uint32_t workers;
    std::uint32_t capacity;  // tasks per deque
    std::uint32_t portion;   // pairs that a block takes at once, from its deque or the initial ones
    Counters* counters;
    Age* ages;               // one per block
    std::uint32_t* bottoms;  // one per block
    NodePair* tasks;         // `capacity` per block

    /// Returns the deque of a block. A pair is one word. Other blocks read it whole, and fail to
    /// take it if it changes meanwhile. So the owner's threads write it like any memory.
    __device__ TaskDeque<DeviceAtomics> deque(std::uint32_t worker) const {
      static_assert(sizeof(NodePair) == sizeof(std::uint64_t) &&
                    alignof(NodePair) == alignof(std::uint64_t));
      auto* const words = reinterpret_cast<std::uint64_t*>(tasks);
      return {ages[worker], bottoms[worker], words + std::size_t{worker} * capacity, capacity};
    }
    __device__ Termination<DeviceAtomics> termination() const {
      return Termination<DeviceAtomics>(counters->live);
    }
  };

  /// Resets the counters. The deques are empty, from the last run or from zeroed memory.
  __device__ static void start(const View& view, const TraversalJob& job) {
    view.counters->live = (initial_count(job) + view.portion - 1) / view.portion;
    view.counters->claimed = 0;
  }

  __device__ void arrive(const View& view, const TraversalJob& job) {
    view_ = view;
    initial_ = job.initial;
    claims_.start(initial_count(job));
    busy_ = false;
    steals_ = overflows_ = 0;
  }
  __device__ void leave(const View&, const TraversalJob& job) {
    if (threadIdx.x != 0) return;
    add(job.counters->steals, steals_);
    add(job.counters->overflows, overflows_);
  }

  __device__ Batch<NodePair> own_batch() {
    std::uint64_t* newest = nullptr;
    if (const std::uint32_t count = deque().pop(view_.portion, newest))
      return {reinterpret_cast<const NodePair*>(newest), count, no_chunk};
    const Portion portion = claims_.next<DeviceAtomics>(view_.counters->claimed, view_.portion);
    // The portion's unit of `live` becomes the block's own. If the block has one already, it is one
    // too many.
    if (busy_) view_.termination().unit_ended();
    busy_ = portion.count != 0;
    return {initial_ + portion.first, portion.count, no_chunk};
  }
  __device__ void release(const Batch<NodePair>&) {}

  /// All pairs leave that the block does not test in the next round. Thieves find what they would
  /// find if the others also went to the deque and back.
  __device__ static std::uint32_t leaving(const StackShape& shape, std::uint32_t size, bool) {
    return size > shape.keep ? size - shape.keep : 0;
  }
  __device__ bool asked(const View&) const { return false; }
  __device__ Room room(std::uint32_t wanted) {
    const std::uint32_t count = min(wanted, deque().room());
    if (count < wanted) ++overflows_;
    return {reinterpret_cast<NodePair*>(deque().next()), count};
  }
  __device__ void publish(const View&, std::uint32_t count) { deque().push(count); }

  __device__ void wait_for_batch(const View& view, const TraversalJob& job,
                                 Batch<NodePair>& found) {
    const std::uint32_t lane = threadIdx.x % kWarp;
    std::uint32_t window = (blockIdx.x + 1) % view.workers;
    for (SpinWait waiting;; waiting.pause()) {
      random_delay(job);
      if (all_done(view.termination())) {
        if (lane == 0) found = {nullptr, 0, no_chunk};
        return;
      }
      auto victim = view.deque((window + lane) % view.workers);
      const bool promising = lane < view.workers && victim.promising();
      window = (window + kWarp) % view.workers;
      if (__ballot_sync(kAllLanes, promising) == 0) continue;
      // The block counts as busy before it takes anything. The victim may become idle at once, and
      // if no block were counted then, the others would leave.
      if (lane == 0) view.termination().chunk_published();
      __syncwarp();
      std::uint64_t task = 0;
      const bool stolen = promising && victim.steal(task);
      const unsigned winners = __ballot_sync(kAllLanes, stolen);
      if (stolen)
        stolen_[__popc(winners & lanes_below(lane))] = {static_cast<std::uint32_t>(task),
                                                        static_cast<std::uint32_t>(task >> 32)};
      if (lane == 0) {
        busy_ = winners != 0;
        if (!busy_) view.termination().unit_ended();
        steals_ += __popc(winners);
        found = {stolen_, static_cast<std::uint32_t>(__popc(winners)), no_chunk};
      }
      if (winners != 0) return;
    }
  }

 private:
  __device__ TaskDeque<DeviceAtomics> deque() const { return view_.deque(blockIdx.x); }

  View view_;
  const NodePair* initial_;
  Claims claims_;
  bool busy_;  // holds a unit of `live`
  std::uint64_t steals_, overflows_;
  NodePair stolen_[kWarp];
};

}  // namespace lazyccd::gpu::research
