// Input and output of every traversal strategy: structures of device pointers, passed by value.
#pragma once

#include <cstdint>

#include "core/bvh/node_pair.h"
#include "core/bvh/tree.h"
#include "gpu/scene/group_view.cuh"

namespace lazyccd {

/// Counters of one launch, on the device until the host reads them. The first two go on counting
/// when their output is full. The kernels reserve room in both by one 64-bit addition.
struct alignas(8) TraversalCounters {
  std::uint32_t leaf_pairs;
  std::uint32_t front_nodes;  // pairs at which the traversal ended, kept as a front or not
  std::uint64_t tree_tests;
  std::uint64_t steals;       // batches taken from another block
  std::uint64_t overflows;    // times that pairs stayed with their block for lack of room
  std::uint64_t lost;         // work dropped for lack of room: the run is void
  std::uint64_t balancings;   // static list: rounds after the first
  std::uint64_t idle_cycles;  // time that blocks waited for work
  std::uint64_t cycles;       // time from start to end; both are summed over the blocks
};

namespace gpu {

/// One traversal: its input, its outputs and their capacities.
struct TraversalJob {
  const TreeNode* nodes;
  std::uint32_t node_count;
  GroupView groups;                    // decides which pairs of leaves may touch
  const NodePair* initial;             // pairs that the traversal starts from
  const std::uint32_t* initial_count;  // on the device; null: start from the root with itself
  NodePair* leaf_pairs;                // out: pairs of groups that may touch, the smaller id first
  std::uint32_t leaf_pair_capacity;
  NodePair* front;  // out; null if none is kept
  std::uint32_t front_capacity;
  TraversalCounters* counters;
  std::uint32_t delay_ns;  // random waits of up to this time, for tests; usually 0
};

}  // namespace gpu
}  // namespace lazyccd
