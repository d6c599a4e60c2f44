// The baseline: one thread takes one group and finds all groups that overlap it, from the root and
// on its own. Another kernel decides which of the pairs may touch; there every thread of a warp has
// a pair.
#include <cooperative_groups.h>

#include <algorithm>
#include <string>

#include "gpu/device/check.h"
#include "gpu/device/device_buffer.h"
#include "gpu/device/grid.h"
#include "gpu/narrow/query.cuh"
#include "gpu/traversal/traversal_strategy.h"
#include "gpu/traversal/traverse.cuh"
#include "lazyccd/error.h"
#include "research/gpu_culling/node_culling.cuh"
#include "research/gpu_strategies/strategies.h"

namespace lazyccd::gpu::research {
namespace {

// Bound of the depth of a tree: its keys have 32 + 64 + 31 bits (core/bvh/radix_tree.h).
constexpr int kMaxDepth = 128;

// Pairs of groups whose boxes overlap. TraversalCounters::front_nodes counts them, as pairs at
// which the traversal ended.
struct Overlapping {
  NodePair* pairs;
  std::uint32_t capacity;
};

// Appends a pair. Some threads of a warp may call it at once.
__device__ void emit(const TraversalJob& job, const Overlapping& out, std::int32_t a,
                     std::int32_t b) {
  const auto together = cooperative_groups::coalesced_threads();
  std::uint32_t first = 0;
  if (together.thread_rank() == 0) first = atomicAdd(&job.counters->front_nodes, together.size());
  const std::uint32_t at = together.shfl(first, 0) + together.thread_rank();
  if (at < out.capacity)
    out.pairs[at] = {static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b)};
}

// Finds all groups that overlap the leaf `self`.
template <bool culls>
__device__ void query(const TraversalJob& job, const Overlapping& out, std::uint32_t self,
                      const NodeCulling& culling, std::uint64_t& tests, std::uint64_t& lost,
                      CulledPairs& culled) {
  const TreeNode box = load_node(job.nodes, self);
  if (culls && culling.flat_node(self)) {
    ++culled.flat;
  } else {
    emit(job, out, box.group(), box.group());
  }
  std::uint32_t stack[kMaxDepth];
  int depth = 0;
  stack[depth++] = 0;
  while (depth != 0) {
    const std::uint32_t other = stack[--depth];
    const TreeNode node = load_node(job.nodes, other);
    ++tests;
    if (!overlap(box, node)) continue;
    if (culls && other != self) {
      // The diagonals of leaves are tested later, with the pair of groups.
      const NodePair pair{self, other};
      if (culling.boxes_apart(pair) || (!node.leaf() && culling.diagonals_apart(pair))) {
        ++culled.by_volume;
        continue;
      }
    }
    if (node.leaf()) {
      if (box.group() < node.group()) emit(job, out, box.group(), node.group());
    } else if (depth + 2 <= kMaxDepth) {
      const ChildrenToVisit children =
          children_to_visit(job.nodes, node, static_cast<std::int32_t>(self));
      for (int i = children.count; i-- > 0;)
        stack[depth++] = static_cast<std::uint32_t>(children.node[i]);
    } else {
      ++lost;
    }
  }
}

// Each block takes twice as many nodes as it has threads, because about half of them are leaves.
template <bool culls>
__global__ void __launch_bounds__(kMaxTraversalBlock)
    query_each_group(TraversalJob job, Overlapping out, NodeCulling culling) {
  extern __shared__ std::uint32_t leaves[];
  __shared__ std::uint32_t leaf_count;
  const std::uint32_t tile = 2 * blockDim.x;
  std::uint64_t tests = 0, lost = 0;
  CulledPairs culled;
  for (std::uint64_t first = std::uint64_t{blockIdx.x} * tile; first < job.node_count;
       first += std::uint64_t{gridDim.x} * tile) {
    if (threadIdx.x == 0) leaf_count = 0;
    __syncthreads();
    const auto last = static_cast<std::uint32_t>(min(first + tile, std::uint64_t{job.node_count}));
    for (auto i = static_cast<std::uint32_t>(first) + threadIdx.x; i < last; i += blockDim.x)
      if (job.nodes[i].leaf()) leaves[atomicAdd(&leaf_count, 1u)] = i;
    __syncthreads();
    for (std::uint32_t i = threadIdx.x; i < leaf_count; i += blockDim.x) {
      random_delay(job);
      query<culls>(job, out, leaves[i], culling, tests, lost, culled);
    }
    __syncthreads();
  }
  add(job.counters->tree_tests, tests);
  add(job.counters->lost, lost);
  if constexpr (culls) culled.add_to(*culling.counters);
}

// Keeps the overlapping pairs that may touch.
__global__ void open_pairs(TraversalJob job, Overlapping found) {
  begin_kernel();
  const Output<NodePair> out{job.leaf_pairs, job.leaf_pair_capacity, &job.counters->leaf_pairs};
  const std::uint32_t ended = job.counters->front_nodes, count = min(ended, found.capacity);
  for (std::uint32_t base = blockIdx.x * blockDim.x; base < count; base += gridDim.x * blockDim.x) {
    const std::uint32_t i = base + threadIdx.x;
    const NodePair pair = i < count ? found.pairs[i] : NodePair{0, 0};
    const bool opens = i < count && job.groups.opens(static_cast<std::int32_t>(pair.a),
                                                     static_cast<std::int32_t>(pair.b));
    append_lanes(out, opens, pair, static_cast<int>(threadIdx.x % kWarp));
  }
  if (blockIdx.x == 0 && threadIdx.x == 0) add(job.counters->lost, ended - count);
}

__global__ void clear_counters(TraversalJob job) {
  begin_kernel();
  *job.counters = {};
}

class ThreadPerQuery : public TraversalStrategy {
 public:
  ThreadPerQuery(const Tuning& tuning, bool culls)
      : tuning_(tuning),
        culls_(culls),
        block_size_(tuning.block_size != 0 ? tuning.block_size : 64) {
    if (block_size_ < 32 || block_size_ > static_cast<int>(kMaxTraversalBlock) ||
        block_size_ % 32 != 0)
      throw Error(ErrorCode::invalid_argument, "tuning.block_size must be a multiple of 32 up to " +
                                                   std::to_string(kMaxTraversalBlock));
    if (tuning.blocks < 0) throw Error(ErrorCode::invalid_argument, "tuning.blocks is negative");
  }

  bool has_front() const override { return false; }

  void reset(std::uint32_t node_count, cudaStream_t) override {
    const std::uint64_t tiles = node_count / (2 * static_cast<std::uint64_t>(block_size_)) + 1;
    const int resident = resident_blocks(kernel(), block_size_, shared_bytes());
    blocks_ = tuning_.blocks != 0
                  ? tuning_.blocks
                  : static_cast<int>(std::min<std::uint64_t>(tiles, std::max(resident, 1)));
    const std::size_t hint = tuning_.capacity_hint;
    overlapping_.reserve(hint != 0 ? hint : 24 * std::size_t{node_count} + 1024);
  }

  void start(const TraversalJob& job, cudaStream_t stream) override {
    launch_behind(clear_counters, 1, 1, 0, stream, job);
  }

  void launch(const TraversalJob& job, const NodeCulling* culling, cudaStream_t stream) override {
    const Overlapping found{overlapping_.data(), static_cast<std::uint32_t>(overlapping_.size())};
    kernel()<<<blocks_, block_size_, shared_bytes(), stream>>>(job, found,
                                                               culls_ ? *culling : NodeCulling{});
    LAZYCCD_CUDA_CHECK(cudaGetLastError());
    launch_behind(open_pairs, 8 * multiprocessors(), 128, 0, stream, job, found);
  }

  void grow(const TraversalCounters& counters, cudaStream_t) override {
    const std::size_t found = counters.front_nodes, room = overlapping_.size();
    if (found > room && counters.lost == found - room) {
      overlapping_.reserve(found + found / 4);
      return;
    }
    throw Error(ErrorCode::device,
                "the tree is deeper than " + std::to_string(kMaxDepth) + " levels");
  }

  std::size_t bytes() const override { return overlapping_.bytes(); }

 private:
  using Kernel = void(TraversalJob, Overlapping, NodeCulling);
  Kernel* kernel() const { return culls_ ? query_each_group<true> : query_each_group<false>; }
  std::size_t shared_bytes() const { return 2 * sizeof(std::uint32_t) * block_size_; }

  Tuning tuning_;
  bool culls_;
  int block_size_;
  int blocks_ = 0;
  DeviceBuffer<NodePair> overlapping_;
};

}  // namespace

std::unique_ptr<TraversalStrategy> make_thread_per_query(const Tuning& tuning, bool culls) {
  return std::make_unique<ThreadPerQuery>(tuning, culls);
}

}  // namespace lazyccd::gpu::research
