// Static lists with balancing steps: the host's side.
#include "research/gpu_strategies/static_list.cuh"

#include <algorithm>

#include "gpu/device/pinned_buffer.h"
#include "gpu/traversal/persistent_traversal.cuh"
#include "research/gpu_culling/node_culling.cuh"
#include "research/gpu_strategies/strategies.h"

namespace lazyccd::gpu::research {
namespace {

template <class Culling>
class StaticList : public PersistentTraversal<StaticBlocks, Culling> {
  using Base = PersistentTraversal<StaticBlocks, Culling>;
  using typename Base::Grid;
  using View = StaticBlocks::View;

 public:
  explicit StaticList(const Tuning& tuning)
      : Base(tuning, {kMaxTraversalBlock, static_cast<std::uint32_t>(tuning.stack), 0, false}),
        state_(1) {
    remaining_.reserve(1);
  }

  // The host reads after every round whether there is another one.
  bool asks_device() const override { return true; }

  void launch(const TraversalJob& job, const NodeCulling* culling, cudaStream_t stream) override {
    const Grid& grid = this->grid_for(job);
    const View view = this->view(grid.blocks, grid.shape);
    do {
      this->enqueue_blocks(grid, view, job, culling, stream);
      launch_behind(balance_lists, 1, 1, 0, stream, view, job, grid.blocks);
      LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(stream));
    } while (*remaining_.data() != 0);
  }

  // Enlarges the lists, because full stacks leave their pairs there.
  void grow(const TraversalCounters&, cudaStream_t stream) override {
    capacity_ *= 2;
    make_room(stream);
  }

  std::size_t bytes() const override {
    return state_.bytes() + lists_[0].bytes() + lists_[1].bytes();
  }

 private:
  void make_room(cudaStream_t) override {
    const std::uint32_t hint = this->tuning().capacity_hint;
    capacity_ =
        std::max(capacity_, hint != 0 ? hint : 64 * this->node_count() + 1024 * this->blocks());
    for (auto& list : lists_) list.reserve(capacity_);
  }

  View view(std::uint32_t blocks, const StackShape&) override {
    const auto threshold = static_cast<std::uint32_t>(std::max(this->tuning().idle_threshold, 0));
    View view{};
    view.state = state_.data();
    for (int i = 0; i < 2; ++i) view.lists[i] = lists_[i].data();
    view.capacity = capacity_;
    view.threshold = threshold != 0 ? threshold : std::max(blocks / 2, 1u);  // as in gProximity
    view.min_steps = this->tuning().delay_ns != 0 ? 1 : 8;
    view.remaining = remaining_.data();
    return view;
  }

  std::uint32_t capacity_ = 0;
  DeviceBuffer<StaticBlocks::State> state_;
  DeviceBuffer<NodePair> lists_[2];
  PinnedBuffer<std::uint32_t> remaining_;
};

}  // namespace

std::unique_ptr<TraversalStrategy> make_static_list(const Tuning& tuning, bool culls) {
  if (culls) return std::make_unique<StaticList<NodeCulling>>(tuning);
  return std::make_unique<StaticList<NoCulling>>(tuning);
}

}  // namespace lazyccd::gpu::research
