// Guided self-scheduling: the host's side.
#include "research/gpu_strategies/guided.cuh"

#include <algorithm>

#include "gpu/traversal/persistent_traversal.cuh"
#include "research/gpu_culling/node_culling.cuh"
#include "research/gpu_strategies/strategies.h"

namespace lazyccd::gpu::research {
namespace {

// Returns the size of the list that a block gives to the others, in pairs.
std::uint32_t list_size(const Tuning& tuning) {
  return tuning.capacity_hint != 0 ? std::min(tuning.capacity_hint, 1024u) : 1024u;
}

template <class Culling>
class Guided : public PersistentTraversal<GuidedBlocks, Culling> {
  using Base = PersistentTraversal<GuidedBlocks, Culling>;
  using View = GuidedBlocks::View;

 public:
  explicit Guided(const Tuning& tuning)
      : Base(tuning, {list_size(tuning), 0, 0, true}), list_size_(list_size(tuning)) {}

  // Doubles the reserve of the stacks. A block that gets too many pairs cannot put them anywhere
  // else.
  void grow(const TraversalCounters&, cudaStream_t stream) override {
    reserve_ *= 2;
    this->shape_stacks({list_size_, 0, reserve_, true});
    this->reset(this->node_count(), stream);
  }

  std::size_t bytes() const override {
    return counters_.bytes() + unread_.bytes() + lists_.bytes();
  }

 private:
  // Allocates and clears. Zeroed memory means that all lists have been read.
  void make_room(cudaStream_t stream) override {
    reserve_zeroed(counters_, 1, stream);
    reserve_zeroed(unread_, this->blocks(), stream);
    lists_.reserve(std::size_t{this->blocks()} * list_size_);
  }

  View view(std::uint32_t blocks, const StackShape& shape) override {
    View view{};
    view.workers = blocks;
    view.list_size = list_size_;
    view.least = std::min(shape.keep, shape.batch);  // what a block tests in one round
    view.most = shape.batch;
    view.counters = counters_.data();
    view.unread = unread_.data();
    view.lists = lists_.data();
    return view;
  }

  std::uint32_t list_size_, reserve_ = 256;
  DeviceBuffer<View::Counters> counters_;
  DeviceBuffer<View::Spaced<std::uint32_t>> unread_;
  DeviceBuffer<NodePair> lists_;
};

}  // namespace

std::unique_ptr<TraversalStrategy> make_guided(const Tuning& tuning, bool culls) {
  if (culls) return std::make_unique<Guided<NodeCulling>>(tuning);
  return std::make_unique<Guided<NoCulling>>(tuning);
}

}  // namespace lazyccd::gpu::research
