// Static lists between blocks: the parts that research/protocols/static_list.h leaves to the
// caller. A round is one launch, in which each block works through its even part of one list. Once
// enough blocks have run out of work, all stop. Each block then appends its remaining pairs to the
// next list. So the balancing step moves nothing: the next round cuts that list into even parts.
#pragma once

#include <cstdint>

#include "balance/device_atomics.cuh"
#include "gpu/traversal/traversal_job.h"
#include "gpu/traversal/traverse.cuh"
#include "research/protocols/static_list.h"

namespace lazyccd::gpu::research {

using namespace lazyccd::research;

/// Returns the device's global time in nanoseconds.
__device__ inline std::uint64_t nanoseconds() {
  std::uint64_t now;
  asm volatile("mov.u64 %0, %%globaltimer;" : "=l"(now));
  return now;
}

class StaticBlocks {
 public:
  static constexpr bool keeps_time = true;  // from the start of a round to its end

  struct State {
    const NodePair* list;  // of this round
    std::uint32_t count;
    std::uint32_t left;        // pairs in the next round's list
    std::uint32_t next;        // index of the next round's list
    std::uint32_t idle, stop;  // RoundEnd
    std::uint64_t began;       // start of this round, in nanoseconds
    std::uint64_t worked;      // time from then on, summed over the blocks
  };
  struct View {
    State* state;
    NodePair* lists[2];
    std::uint32_t capacity;    // pairs of a list
    std::uint32_t threshold;   // number of idle blocks that ends a round
    std::uint32_t min_steps;   // steps of a block before it may stop, so that it makes progress
    std::uint32_t* remaining;  // out, for the host: pairs of the next round

    __device__ RoundEnd<DeviceAtomics> round_end() const {
      return {state->idle, state->stop, threshold};
    }
  };

  __device__ static void start(const View& view, const TraversalJob& job) {
    *view.state = {};
    view.state->list = job.initial;
    view.state->count = initial_count(job);
    view.state->began = nanoseconds();
  }

  /// The balancing step, by one thread: the pairs that the blocks left are the next list.
  __device__ static void balance(const View& view, const TraversalJob& job, std::uint32_t blocks) {
    State& state = *view.state;
    const std::uint64_t now = nanoseconds(), present = blocks * (now - state.began);
    job.counters->cycles += present;
    if (present > state.worked) job.counters->idle_cycles += present - state.worked;
    job.counters->balancings += state.left != 0;
    state.count = state.left;
    state.list = view.lists[state.next];
    state.next = 1 - state.next;
    state.left = state.idle = state.stop = 0;
    state.worked = 0;
    state.began = now;
    *view.remaining = state.count;
  }

  __device__ void arrive(const View& view, const TraversalJob&) {
    const EvenPart part = even_part(view.state->count, blockIdx.x, gridDim.x);
    view_ = view;
    next_ = view.state->list + part.first;
    rest_ = static_cast<std::uint32_t>(part.count);
    steps_ = 0;
    overflows_ = 0;
    stopped_ = false;
  }

  __device__ Batch<NodePair> own_batch() {
    const std::uint32_t count = stopped_ ? 0 : min(rest_, blockDim.x);
    const Batch<NodePair> batch{next_, count, no_chunk};
    next_ += count;
    rest_ -= count;
    return batch;
  }
  __device__ void release(const Batch<NodePair>&) {}

  /// All pairs leave if the round ends or if the stack is crowded; the latter ends the round too.
  __device__ static std::uint32_t leaving(const StackShape& shape, std::uint32_t size, bool asked) {
    return asked || size > shape.crowded ? size : 0;
  }
  __device__ bool asked(const View& view) {
    return ++steps_ >= view.min_steps && view.round_end().stopped();
  }
  /// Reserves space for the pairs of the stack and, behind them, for the pairs that the block has
  /// not begun. If there is not enough space for all, the block continues alone.
  __device__ Room room(std::uint32_t wanted) {
    view_.round_end().stop();
    NodePair* const place = reserve(wanted + rest_);
    if (place == nullptr) return {nullptr, 0};
    stopped_ = true;
    rest_place_ = place + wanted;
    return {place, wanted};
  }
  __device__ void publish(const View&, std::uint32_t) {}

  /// Finds nothing: no block gives work before the end of the round.
  __device__ void wait_for_batch(const View& view, const TraversalJob&, Batch<NodePair>& found) {
    if (threadIdx.x != 0) return;
    if (!stopped_) view_.round_end().ran_dry();
    found = {nullptr, 0, no_chunk};
  }

  __device__ void leave(const View& view, const TraversalJob& job) {
    if (stopped_)
      for (std::uint32_t i = threadIdx.x; i < rest_; i += blockDim.x) rest_place_[i] = next_[i];
    if (threadIdx.x != 0) return;
    add(view.state->worked, nanoseconds() - view.state->began);
    add(job.counters->overflows, overflows_);
  }

 private:
  /// Reserves space in the next list; returns null if there is not enough.
  __device__ NodePair* reserve(std::uint32_t count) {
    // Relaxed: the end of the round publishes the lists.
    std::uint32_t& left = view_.state->left;
    std::uint32_t first = DeviceAtomics::load(left, DeviceAtomics::relaxed);
    while (view_.capacity - first >= count)
      if (DeviceAtomics::compare_exchange(left, first, first + count, DeviceAtomics::relaxed,
                                          DeviceAtomics::relaxed))
        return view_.lists[view_.state->next] + first;
    ++overflows_;
    return nullptr;
  }

  View view_;
  const NodePair* next_;  // next pair of the block's own part
  std::uint32_t rest_;
  NodePair* rest_place_;  // for the rest, in the next list
  std::uint32_t steps_;
  std::uint64_t overflows_;
  bool stopped_;
};

__global__ inline void balance_lists(StaticBlocks::View view, TraversalJob job,
                                     std::uint32_t blocks) {
  begin_kernel();
  StaticBlocks::balance(view, job, blocks);
}

}  // namespace lazyccd::gpu::research
