// Task stealing: the host's side.
#include "research/gpu_strategies/task_stealing.cuh"

#include <algorithm>

#include "gpu/traversal/persistent_traversal.cuh"
#include "research/gpu_culling/node_culling.cuh"
#include "research/gpu_strategies/strategies.h"

namespace lazyccd::gpu::research {
namespace {

template <class Culling>
class TaskStealing : public PersistentTraversal<TaskBlocks, Culling> {
  using Base = PersistentTraversal<TaskBlocks, Culling>;
  using View = TaskBlocks::View;

 public:
  explicit TaskStealing(const Tuning& tuning) : Base(tuning, {kMaxTraversalBlock, 0, 0, true}) {}

  void grow(const TraversalCounters&, cudaStream_t stream) override {
    capacity_ *= 2;
    make_room(stream);
  }

  std::size_t bytes() const override {
    return counters_.bytes() + ages_.bytes() + bottoms_.bytes() + tasks_.bytes();
  }

 private:
  // Allocates and clears. Zeroed memory means empty deques.
  void make_room(cudaStream_t stream) override {
    const std::uint32_t hint = this->tuning().capacity_hint;
    capacity_ = std::max(capacity_, hint != 0 ? hint : 4096u);
    reserve_zeroed(counters_, 1, stream);
    reserve_zeroed(ages_, this->blocks(), stream);
    reserve_zeroed(bottoms_, this->blocks(), stream);
    tasks_.reserve(std::size_t{this->blocks()} * capacity_);
  }

  View view(std::uint32_t blocks, const StackShape& shape) override {
    View view{};
    view.workers = blocks;
    view.capacity = capacity_;
    view.portion = shape.keep;
    view.counters = counters_.data();
    view.ages = ages_.data();
    view.bottoms = bottoms_.data();
    view.tasks = tasks_.data();
    return view;
  }

  std::uint32_t capacity_ = 0;  // tasks per deque
  DeviceBuffer<TaskBlocks::Counters> counters_;
  DeviceBuffer<TaskBlocks::Age> ages_;
  DeviceBuffer<std::uint32_t> bottoms_;
  DeviceBuffer<NodePair> tasks_;
};

}  // namespace

std::unique_ptr<TraversalStrategy> make_task_stealing(const Tuning& tuning, bool culls) {
  if (culls) return std::make_unique<TaskStealing<NodeCulling>>(tuning);
  return std::make_unique<TaskStealing<NoCulling>>(tuning);
}

}  // namespace lazyccd::gpu::research
