// What every traversal strategy gets and gives: plain pointers to device memory, passed by value.
#pragma once

#include <cstdint>

#include "core/node_pair.h"
#include "core/tree.h"
#include "gpu/scene/group_view.cuh"

namespace lazyccd {

// Of one launch, on the device until the host reads it. The first two count on where their output
// is full, and the kernels reserve room in both by one 64-bit addition.
struct alignas(8) TraversalCounters {
  std::uint32_t leaf_pairs;
  std::uint32_t front_nodes;  // pairs where the traversal ended, kept as a front or not
  std::uint64_t tree_tests;
  std::uint64_t steals;       // batches taken from another block
  std::uint64_t overflows;    // times that pairs stayed with their block for want of room
  std::uint64_t lost;         // work dropped for want of room: the run is void
  std::uint64_t balancings;   // of the static list: rounds after the first
  std::uint64_t idle_cycles;  // that blocks waited for work
  std::uint64_t cycles;       // from start to end, summed over the blocks too
};

namespace gpu {

struct TraversalJob {
  const TreeNode* nodes;
  std::uint32_t node_count;
  GroupView groups;                    // decides which pairs of leaves are worth a visit
  const NodePair* initial;             // where the traversal starts
  const std::uint32_t* initial_count;  // on the device; null: the root with itself
  NodePair* leaf_pairs;                // out: groups worth a visit, the smaller id first
  std::uint32_t leaf_pair_capacity;
  NodePair* front;  // out; null where none is kept
  std::uint32_t front_capacity;
  TraversalCounters* counters;
  std::uint32_t delay_ns;  // random waits of up to this time, for tests; usually 0
};

}  // namespace gpu
}  // namespace lazyccd
