// Task stealing: the host's side.
#include "gpu/traversal/task_stealing.cuh"

#include <algorithm>

#include "gpu/traversal/persistent_traversal.cuh"

namespace lazyccd::gpu {
namespace {

class TaskStealing : public PersistentTraversal<TaskBlocks> {
 public:
  explicit TaskStealing(const Tuning& tuning)
      : PersistentTraversal(tuning, {kMaxTraversalBlock, 0, 0, true}) {}

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
    const std::uint32_t hint = tuning().capacity_hint;
    capacity_ = std::max(capacity_, hint != 0 ? hint : 4096u);
    reserve_zeroed(counters_, 1, stream);
    reserve_zeroed(ages_, blocks(), stream);
    reserve_zeroed(bottoms_, blocks(), stream);
    tasks_.reserve(std::size_t{blocks()} * capacity_);
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

std::unique_ptr<TraversalStrategy> make_task_stealing(const Tuning& tuning) {
  return std::make_unique<TaskStealing>(tuning);
}

}  // namespace lazyccd::gpu
