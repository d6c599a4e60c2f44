// The baseline: a thread takes one group and finds all that overlap it, from the root and on its
// own.
#include <cooperative_groups.h>

#include <algorithm>
#include <string>

#include "gpu/check.h"
#include "gpu/grid.h"
#include "gpu/traversal_strategy.h"
#include "gpu/traverse.cuh"
#include "lazyccd/error.h"

namespace lazyccd::gpu {
namespace {

// A tree split by Morton codes of 63 bits, and where they are equal in halves, is not deeper.
constexpr int kMaxDepth = 96;

// For some threads of a warp at once.
__device__ void emit_leaf_pair(const TraversalJob& job, std::int32_t a, std::int32_t b) {
  const auto together = cooperative_groups::coalesced_threads();
  std::uint32_t first = 0;
  if (together.thread_rank() == 0)
    first = static_cast<std::uint32_t>(reserve_output(job, together.size(), together.size()));
  store_leaf_pair(job, together.shfl(first, 0) + together.thread_rank(), a, b);
}

__device__ void query(const TraversalJob& job, std::uint32_t self, std::uint64_t& tests,
                      std::uint64_t& lost) {
  const TreeNode box = load_node(job.nodes, self);
  if (job.groups.opens(box.group(), box.group())) emit_leaf_pair(job, box.group(), box.group());
  std::uint32_t stack[kMaxDepth];
  int depth = 0;
  stack[depth++] = 0;
  while (depth != 0) {
    const TreeNode node = load_node(job.nodes, stack[--depth]);
    ++tests;
    if (!overlap(box, node)) continue;
    if (node.leaf()) {
      if (box.group() < node.group() && job.groups.opens(box.group(), node.group()))
        emit_leaf_pair(job, box.group(), node.group());
    } else if (depth + 2 <= kMaxDepth) {
      stack[depth++] = static_cast<std::uint32_t>(node.right);
      stack[depth++] = static_cast<std::uint32_t>(node.left);
    } else {
      ++lost;
    }
  }
}

// A block takes twice as many nodes as it has threads: half of them, more or less, are leaves.
__global__ void __launch_bounds__(kMaxTraversalBlock) query_each_group(TraversalJob job) {
  extern __shared__ std::uint32_t leaves[];
  __shared__ std::uint32_t leaf_count;
  const std::uint32_t tile = 2 * blockDim.x;
  std::uint64_t tests = 0, lost = 0;
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
      query(job, leaves[i], tests, lost);
    }
    __syncthreads();
  }
  add(job.counters->tree_tests, tests);
  add(job.counters->lost, lost);
}

class ThreadPerQuery : public TraversalStrategy {
 public:
  explicit ThreadPerQuery(const Tuning& tuning)
      : tuning_(tuning), block_size_(tuning.block_size != 0 ? tuning.block_size : 64) {
    if (block_size_ < 32 || block_size_ > static_cast<int>(kMaxTraversalBlock) ||
        block_size_ % 32 != 0)
      throw Error(ErrorCode::invalid_argument,
                  "a block of the traversal has a multiple of 32 threads up to " +
                      std::to_string(kMaxTraversalBlock));
    if (tuning.blocks < 0) throw Error(ErrorCode::invalid_argument, "tuning.blocks is negative");
  }

  bool has_front() const override { return false; }

  void reset(std::uint32_t node_count, cudaStream_t) override {
    const std::uint64_t tiles = node_count / (2 * static_cast<std::uint64_t>(block_size_)) + 1;
    const int resident = resident_blocks(query_each_group, block_size_, shared_bytes());
    blocks_ = tuning_.blocks != 0
                  ? tuning_.blocks
                  : static_cast<int>(std::min<std::uint64_t>(tiles, std::max(resident, 1)));
  }

  void launch(const TraversalJob& job, cudaStream_t stream) override {
    LAZYCCD_CUDA_CHECK(cudaMemsetAsync(job.counters, 0, sizeof(TraversalCounters), stream));
    query_each_group<<<blocks_, block_size_, shared_bytes(), stream>>>(job);
    LAZYCCD_CUDA_CHECK(cudaGetLastError());
  }

  void grow(cudaStream_t) override {
    throw Error(ErrorCode::device,
                "the tree is deeper than " + std::to_string(kMaxDepth) + " levels");
  }

  std::size_t bytes() const override { return 0; }

 private:
  std::size_t shared_bytes() const { return 2 * sizeof(std::uint32_t) * block_size_; }

  Tuning tuning_;
  int block_size_;
  int blocks_ = 0;
};

}  // namespace

std::unique_ptr<TraversalStrategy> make_thread_per_query(const Tuning& tuning) {
  return std::make_unique<ThreadPerQuery>(tuning);
}

}  // namespace lazyccd::gpu
