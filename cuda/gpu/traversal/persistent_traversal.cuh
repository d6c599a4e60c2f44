// The host's side of a traversal by persistent blocks (traverse.cuh): the sizes of grids and
// stacks, and the launches. A strategy adds the memory behind its blocks' view.
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

/// Returns the stack size beyond which surplus leaves, for strategies that offer it whether another
/// block waits or not. Blocks only get what others offer.
inline std::uint32_t small_stack(const Tuning& tuning) {
  return static_cast<std::uint32_t>(tuning.stack != 0 ? tuning.stack : 512);
}

/// The requested shape of a block's stack. 0: the default.
struct StackRequest {
  std::uint32_t batch;    // pairs that leave or arrive at once
  std::uint32_t crowded;  // pairs beyond which the oldest leave
  std::uint32_t reserve;
  bool keeps;  // the block keeps as many pairs as it tests in one round
};

/// Returns the shape of the stack for blocks of `threads` threads.
inline StackShape stack_shape(const Tuning& tuning, const StackRequest& request,
                              std::uint32_t threads) {
  StackShape shape{};
  shape.batch = request.batch;
  // A depth-first walk from one pair holds at most three pairs for each level of the tree.
  shape.reserve = request.reserve != 0 ? request.reserve : 256;
  const std::uint32_t min_capacity = std::max(request.batch, request.crowded) + shape.reserve + 2;
  const std::uint32_t usual_capacity = std::max(8 * threads, 4 * request.batch);
  shape.capacity = next_power_of_two(
      tuning.capacity_hint != 0 ? min_capacity : std::max(min_capacity, usual_capacity));
  const std::uint32_t usable = shape.capacity - shape.reserve;
  shape.crowded = tuning.delay_ns != 0   ? 32  // to test balancing
                  : request.crowded != 0 ? request.crowded
                  : usable > 2 * threads ? std::max(usable - 2 * threads, usable / 2)
                                         : usable / 2;
  shape.keep = !request.keeps ? 0 : tuning.delay_ns != 0 ? 1 : threads;
  return shape;
}

/// Ensures room for `count` items and clears the whole buffer.
template <class T>
void reserve_zeroed(DeviceBuffer<T>& buffer, std::size_t count, cudaStream_t stream) {
  buffer.reserve(count);
  LAZYCCD_CUDA_CHECK(cudaMemsetAsync(buffer.data(), 0, buffer.bytes(), stream));
}

/// A strategy that runs the kernel traverse() with the balancing class Blocks.
template <class Blocks, class Culling>
class PersistentTraversal : public TraversalStrategy {
 public:
  bool has_front() const override { return true; }

  void reset(std::uint32_t node_count, cudaStream_t stream) override {
    for (Grid* grid : {&from_root_, &from_front_}) {
      const int resident =
          resident_blocks(traverse<Blocks, Culling>, grid->threads, grid->stack_bytes());
      // Blocks beyond the number of batches of a usual front would only wait.
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

  void launch(const TraversalJob& job, const NodeCulling* culling, cudaStream_t stream) override {
    const Grid& grid = grid_for(job);
    enqueue_blocks(grid, view(grid.blocks, grid.shape), job, culling, stream);
  }

 protected:
  using View = typename Blocks::View;

  /// A grid and the stacks of its blocks.
  struct Grid {
    int threads = 0;  // per block
    std::uint32_t blocks = 0;
    StackShape shape{};

    std::size_t stack_bytes() const { return shape.capacity * sizeof(NodePair); }
  };

  PersistentTraversal(const Tuning& tuning, const StackRequest& request) : tuning_(tuning) {
    const int threads = tuning.block_size;
    if (threads != 0 &&
        (threads < 32 || threads > static_cast<int>(kMaxTraversalBlock) || threads % 32 != 0))
      throw Error(ErrorCode::invalid_argument, "tuning.block_size must be a multiple of 32 up to " +
                                                   std::to_string(kMaxTraversalBlock));
    if (tuning.blocks < 0) throw Error(ErrorCode::invalid_argument, "tuning.blocks is negative");
    // From the root, each round goes one level deeper, and a larger block has more of a level at
    // once. From a front, all blocks have work from the first round on.
    from_root_.threads = threads != 0 ? threads : 512;
    from_front_.threads = threads != 0 ? threads : 256;
    shape_stacks(request);
  }

  void shape_stacks(const StackRequest& request) {
    for (Grid* grid : {&from_root_, &from_front_}) {
      grid->shape = stack_shape(tuning_, request, static_cast<std::uint32_t>(grid->threads));
      if (grid->stack_bytes() > max_stack_bytes)
        throw Error(ErrorCode::device, "a block's stack of " +
                                           std::to_string(grid->shape.capacity) +
                                           " pairs is too large for the device");
    }
  }

  /// Allocates the memory of the view for blocks() blocks and trees of node_count() nodes, and
  /// clears it. A run that lost work needs this too.
  virtual void make_room(cudaStream_t stream) = 0;
  virtual View view(std::uint32_t blocks, const StackShape& shape) = 0;

  const Tuning& tuning() const { return tuning_; }
  std::uint32_t node_count() const { return node_count_; }
  std::uint32_t blocks() const { return std::max(from_root_.blocks, from_front_.blocks); }
  const Grid& grid_for(const TraversalJob& job) const {
    return job.initial_counters != nullptr ? from_front_ : from_root_;
  }
  void enqueue_blocks(const Grid& grid, const View& view, const TraversalJob& job,
                      const NodeCulling* culling, cudaStream_t stream) const {
    launch_behind(traverse<Blocks, Culling>, grid.blocks, static_cast<std::uint32_t>(grid.threads),
                  grid.stack_bytes(), stream, view, job, grid.shape, Culling::of(culling));
  }

 private:
  // The shared memory that a kernel has by default, less what a block's own variables take.
  static constexpr std::size_t max_stack_bytes = 40 << 10;

  Tuning tuning_;
  Grid from_root_, from_front_;
  std::uint32_t node_count_ = 0;
};

}  // namespace lazyccd::gpu
