// What a traversal counts.
#pragma once

#include <cstdint>

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
  std::uint64_t balancings;   // rounds of balancing after the first, if there are rounds
  std::uint64_t idle_cycles;  // time that blocks waited for work
  std::uint64_t cycles;       // time from start to end; both are summed over the blocks
};

}  // namespace lazyccd
