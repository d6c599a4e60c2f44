// The host's side of a traversal by persistent blocks (traverse.cuh): how large grids and stacks
// are, and the launches. A strategy adds the memory behind its blocks' view.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>

#include "gpu/device/device_buffer.h"
#include "gpu/device/grid.h"
#include "gpu/traversal/traversal_strategy.h"
#include "gpu/traversal/traverse.cuh"
#include "lazyccd/error.h"

namespace lazyccd::gpu {

inline std::uint32_t next_power_of_two(std::uint32_t n) {
  std::uint32_t power = 1;
  while (power < n) power *= 2;
  return power;
}

// Where surplus leaves whether somebody waits or not: what a block does not offer nobody gets.
inline std::uint32_t small_stack(const Tuning& tuning) {
  return static_cast<std::uint32_t>(tuning.stack != 0 ? tuning.stack : 512);
}

// What a block's stack is asked to be. 0: the default.
struct StackWish {
  std::uint32_t batch;    // pairs that leave at once, and that come at once
  std::uint32_t crowded;  // pairs beyond which the oldest leave
  std::uint32_t reserve;
  bool keeps;  // what a block tests in one round anyway
};

inline StackShape stack_shape(const Tuning& tuning, const StackWish& wish, std::uint32_t threads) {
  StackShape shape{};
  shape.batch = wish.batch;
  // A depth-first walk from one pair holds three pairs for each level of the tree at most.
  shape.reserve = wish.reserve != 0 ? wish.reserve : 256;
  const std::uint32_t least = std::max(wish.batch, wish.crowded) + shape.reserve + 2;
  const std::uint32_t usual = std::max(8 * threads, 4 * wish.batch);
  shape.capacity = next_power_of_two(tuning.capacity_hint != 0 ? least : std::max(least, usual));
  const std::uint32_t usable = shape.capacity - shape.reserve;
  shape.crowded = tuning.delay_ns != 0   ? 32  // balancing itself is tested
                  : wish.crowded != 0    ? wish.crowded
                  : usable > 2 * threads ? std::max(usable - 2 * threads, usable / 2)
                                         : usable / 2;
  shape.keep = !wish.keeps ? 0 : tuning.delay_ns != 0 ? 1 : threads;
  return shape;
}

// Sets aside memory for `count` and clears all that there is.
template <class T>
void reserve_zeroed(DeviceBuffer<T>& buffer, std::size_t count, cudaStream_t stream) {
  buffer.reserve(count);
  LAZYCCD_CUDA_CHECK(cudaMemsetAsync(buffer.data(), 0, buffer.bytes(), stream));
}

template <class Blocks>
class PersistentTraversal : public TraversalStrategy {
 public:
  bool has_front() const override { return true; }

  void reset(std::uint32_t node_count, bool culls, cudaStream_t stream) override {
    culls_ = culls;
    for (Grid* grid : {&from_root_, &from_front_}) {
      const int resident = resident_blocks(kernel(), grid->threads, grid->stack_bytes());
      // A block beyond the batches of a usual front would only wait.
      const std::uint64_t batches =
          24 * std::uint64_t{node_count} / static_cast<std::uint64_t>(grid->threads) + 1;
      grid->blocks = static_cast<std::uint32_t>(
          tuning_.blocks != 0
              ? tuning_.blocks
              : static_cast<int>(std::min<std::uint64_t>(batches, std::max(resident, 1))));
    }
    node_count_ = node_count;
    make_room(stream);
  }

  void start(const TraversalJob& job, cudaStream_t stream) override {
    const Grid& grid = grid_for(job);
    launch_behind(start_traversal<Blocks>, 1, 1, 0, stream, view(grid.blocks, grid.shape), job);
  }

  void launch(const TraversalJob& job, const NodeCulling& culling, cudaStream_t stream) override {
    const Grid& grid = grid_for(job);
    enqueue_blocks(grid, view(grid.blocks, grid.shape), job, culling, stream);
  }

 protected:
  using View = typename Blocks::View;

  // A grid and its blocks' stacks.
  struct Grid {
    int threads = 0;  // of a block
    std::uint32_t blocks = 0;
    StackShape shape{};

    std::size_t stack_bytes() const { return shape.capacity * sizeof(NodePair); }
  };

  PersistentTraversal(const Tuning& tuning, const StackWish& wish) : tuning_(tuning) {
    const int threads = tuning.block_size;
    if (threads != 0 &&
        (threads < 32 || threads > static_cast<int>(kMaxTraversalBlock) || threads % 32 != 0))
      throw Error(ErrorCode::invalid_argument,
                  "a block of the traversal has a multiple of 32 threads up to " +
                      std::to_string(kMaxTraversalBlock));
    if (tuning.blocks < 0) throw Error(ErrorCode::invalid_argument, "tuning.blocks is negative");
    // From the root each round is a level deeper, and a larger block has more of a level at once;
    // from a front there is work for all from the first round on.
    from_root_.threads = threads != 0 ? threads : 512;
    from_front_.threads = threads != 0 ? threads : 256;
    shape_stacks(wish);
  }

  void shape_stacks(const StackWish& wish) {
    for (Grid* grid : {&from_root_, &from_front_}) {
      grid->shape = stack_shape(tuning_, wish, static_cast<std::uint32_t>(grid->threads));
      if (grid->stack_bytes() > most_stack_bytes)
        throw Error(ErrorCode::device, "a block's stack of " +
                                           std::to_string(grid->shape.capacity) +
                                           " pairs is too large for the device");
    }
  }

  // Of the view: for blocks() blocks and trees of node_count() nodes; cleared, as after a run that
  // lost work.
  virtual void make_room(cudaStream_t stream) = 0;
  virtual View view(std::uint32_t blocks, const StackShape& shape) = 0;

  const Tuning& tuning() const { return tuning_; }
  std::uint32_t node_count() const { return node_count_; }
  bool culls() const { return culls_; }
  std::uint32_t blocks() const { return std::max(from_root_.blocks, from_front_.blocks); }
  const Grid& grid_for(const TraversalJob& job) const {
    return job.initial_count != nullptr ? from_front_ : from_root_;
  }
  void enqueue_blocks(const Grid& grid, const View& view, const TraversalJob& job,
                      const NodeCulling& culling, cudaStream_t stream) const {
    launch_behind(kernel(), grid.blocks, static_cast<std::uint32_t>(grid.threads),
                  grid.stack_bytes(), stream, view, job, grid.shape, culling);
  }

 private:
  // Of shared memory that a kernel has without asking, less what a block's own variables take.
  static constexpr std::size_t most_stack_bytes = 40 << 10;

  auto kernel() const { return culls_ ? traverse<Blocks, true> : traverse<Blocks, false>; }

  Tuning tuning_;
  Grid from_root_, from_front_;
  bool culls_ = false;
  std::uint32_t node_count_ = 0;
};

}  // namespace lazyccd::gpu
