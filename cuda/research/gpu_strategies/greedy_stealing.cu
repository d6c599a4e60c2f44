// Lazy work stealing with greedy thieves: the host's side.
#include "research/gpu_strategies/greedy_stealing.cuh"

#include <algorithm>

#include "gpu/traversal/persistent_traversal.cuh"
#include "research/gpu_culling/node_culling.cuh"
#include "research/gpu_strategies/strategies.h"

namespace lazyccd::gpu::research {
namespace {

StackRequest stack_request(const Tuning& tuning) {
  constexpr int largest = static_cast<int>(GreedyBlocks::batch_size);
  if (tuning.chunk < 0 || tuning.chunk > largest)
    throw Error(ErrorCode::invalid_argument,
                "tuning.chunk must be between 0 and " + std::to_string(largest) + " pairs");
  const int batch = tuning.chunk != 0 ? tuning.chunk : largest;
  return {static_cast<std::uint32_t>(batch), small_stack(tuning), 0, true};
}

template <class Culling>
class GreedyStealing : public PersistentTraversal<GreedyBlocks, Culling> {
  using Base = PersistentTraversal<GreedyBlocks, Culling>;
  using View = GreedyBlocks::View;

 public:
  explicit GreedyStealing(const Tuning& tuning) : Base(tuning, stack_request(tuning)) {}

  void grow(const TraversalCounters&, cudaStream_t stream) override {
    batches_ = std::min(2 * batches_, Deque<DeviceAtomics>::max_capacity);
    make_room(stream);
  }

  std::size_t bytes() const override {
    return counters_.bytes() + words_.bytes() + rings_.bytes() + in_use_.bytes() + chunks_.bytes() +
           won_.bytes();
  }

 private:
  // Allocates and clears. Zeroed memory means empty deques and free batches.
  void make_room(cudaStream_t stream) override {
    const std::uint32_t hint = this->tuning().capacity_hint;
    batches_ = std::max(batches_, hint != 0 ? next_power_of_two(std::min(hint, 8u)) : 8u);
    const std::size_t blocks = this->blocks(), batches = blocks * batches_;
    reserve_zeroed(counters_, 1, stream);
    reserve_zeroed(words_, blocks, stream);
    reserve_zeroed(rings_, batches, stream);
    reserve_zeroed(in_use_, batches, stream);
    chunks_.reserve(batches);
    won_.reserve(blocks * blocks);
  }

  View view(std::uint32_t blocks, const StackShape&) override {
    View view{};
    view.workers = blocks;
    view.batches = batches_;
    view.counters = counters_.data();
    view.deque_words = words_.data();
    view.rings = rings_.data();
    view.in_use = in_use_.data();
    view.chunks = chunks_.data();
    view.won = won_.data();
    return view;
  }

  std::uint32_t batches_ = 0;  // per block
  DeviceBuffer<View::Counters> counters_;
  DeviceBuffer<View::Spaced<std::uint64_t>> words_;
  DeviceBuffer<std::uint32_t> rings_, in_use_, won_;
  DeviceBuffer<Chunk<NodePair, GreedyBlocks::batch_size>> chunks_;
};

}  // namespace

std::unique_ptr<TraversalStrategy> make_greedy_stealing(const Tuning& tuning, bool culls) {
  if (culls) return std::make_unique<GreedyStealing<NodeCulling>>(tuning);
  return std::make_unique<GreedyStealing<NoCulling>>(tuning);
}

}  // namespace lazyccd::gpu::research
