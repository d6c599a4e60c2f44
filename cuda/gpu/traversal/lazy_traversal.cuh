// Lazy work stealing: the host's side.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "gpu/device/device_buffer.h"
#include "gpu/traversal/lazy_stealing.cuh"
#include "gpu/traversal/persistent_traversal.cuh"
#include "gpu/traversal/traversal_strategy.h"
#include "lazyccd/error.h"

namespace lazyccd::gpu {

template <std::uint32_t ChunkSize, class Culling>
class LazyStealing : public PersistentTraversal<LazyBlocks<ChunkSize>, Culling> {
  using Base = PersistentTraversal<LazyBlocks<ChunkSize>, Culling>;
  using View = typename Base::View;

 public:
  explicit LazyStealing(const Tuning& tuning)
      : Base(tuning, {ChunkSize, small_stack(tuning), 0, true}) {}

  void grow(const TraversalCounters&, cudaStream_t stream) override {
    chunk_count_ *= 2;
    ring_capacity_ = std::min(2 * ring_capacity_, Deque<DeviceAtomics>::max_capacity);
    make_room(stream);
  }

  std::size_t bytes() const override {
    return counters_.bytes() + last_giver_.bytes() + words_.bytes() + rings_.bytes() +
           links_.bytes() + chunks_.bytes();
  }

 private:
  using Protocol = decltype(View::shared);
  using Word = typename Protocol::template Spaced<std::uint64_t>;

  // Allocates and clears. Zeroed memory means empty deques and free chunks.
  void make_room(cudaStream_t stream) override {
    const std::uint32_t hint = this->tuning().capacity_hint, blocks = this->blocks();
    ring_capacity_ =
        std::max(ring_capacity_, hint != 0 ? next_power_of_two(std::min(hint, 8u)) : 8u);
    chunk_count_ = std::max(chunk_count_, hint != 0 ? hint : 8 * blocks);
    reserve_zeroed(counters_, 1, stream);
    reserve_zeroed(last_giver_, 1, stream);
    reserve_zeroed(words_, blocks, stream);
    reserve_zeroed(rings_, std::size_t{blocks} * ring_capacity_, stream);
    reserve_zeroed(links_, chunk_count_, stream);
    chunks_.reserve(chunk_count_);
  }

  View view(std::uint32_t blocks, const StackShape&) override {
    View view{};
    view.shared.workers = blocks;
    view.shared.ring_capacity = ring_capacity_;
    view.shared.chunk_count = chunk_count_;
    view.shared.counters = counters_.data();
    view.shared.deque_words = words_.data();
    view.shared.rings = rings_.data();
    view.shared.links = links_.data();
    view.shared.chunks = chunks_.data();
    view.last_giver = last_giver_.data();
    return view;
  }

  std::uint32_t ring_capacity_ = 0, chunk_count_ = 0;
  DeviceBuffer<typename Protocol::Counters> counters_;
  DeviceBuffer<std::uint32_t> last_giver_;
  DeviceBuffer<Word> words_;
  DeviceBuffer<std::uint32_t> rings_, links_;
  DeviceBuffer<Chunk<NodePair, ChunkSize>> chunks_;
};

/// Makes the strategy. Culling: of the kernel traverse().
template <class Culling>
std::unique_ptr<TraversalStrategy> make_lazy_traversal(const Tuning& tuning) {
  switch (tuning.chunk) {
    case 32:
      return std::make_unique<LazyStealing<32, Culling>>(tuning);
    case 128:
      return std::make_unique<LazyStealing<128, Culling>>(tuning);
    case 0:
    case 256:
      return std::make_unique<LazyStealing<256, Culling>>(tuning);
    default:
      throw Error(ErrorCode::invalid_argument, "tuning.chunk must be 32, 128 or 256 pairs");
  }
}

}  // namespace lazyccd::gpu
