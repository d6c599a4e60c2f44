// Input and output of every traversal strategy: structures of device pointers, passed by value.
#pragma once

#include <cstdint>

#include "core/bvh/node_pair.h"
#include "core/bvh/tree.h"
#include "gpu/scene/group_view.cuh"
#include "gpu/scene/traversal_counters.h"

namespace lazyccd {

namespace gpu {

/// One traversal: its input, its outputs and their capacities.
struct TraversalJob {
  const TreeNode* nodes;
  std::uint32_t node_count;
  GroupView groups;                // decides which pairs of leaves may touch
  NodePair* initial;               // pairs that the traversal starts from
  std::uint32_t initial_capacity;  // room for them
  // Of the run that left them as its front; null: start from the root with itself.
  TraversalCounters* initial_counters;
  NodePair* leaf_pairs;  // out: pairs of groups that may touch, the smaller id first
  std::uint32_t leaf_pair_capacity;
  NodePair* front;  // out; null if none is kept
  std::uint32_t front_capacity;
  TraversalCounters* counters;
  std::uint32_t delay_ns;  // random waits of up to this time, for tests; usually 0
};

}  // namespace gpu
}  // namespace lazyccd
