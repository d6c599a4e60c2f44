// The state of one worker thread of the CPU backend.
#pragma once

#include <cstdint>
#include <vector>

#include "core/bvh/node_pair.h"
#include "cpu/cpu_detector.h"
#include "cpu/narrow/narrow_phase.h"

namespace lazyccd {

/// One worker: its part of the traversal, and the narrow phase behind it.
struct alignas(128) CpuDetector::Worker : NarrowPhase {
  std::vector<NodePair> front;       // pairs where the traversal ended
  std::vector<NodePair> unexpanded;  // pairs not visited because of an interruption
  // Pairs of groups visited that do not both rest, pairs where the traversal ended, pairs culled,
  // and nodes culled because they do not touch themselves.
  std::int64_t group_pairs = 0, ended = 0, culled = 0, flat = 0;
  std::int64_t listable = 0;  // number of group_pairs that a Verlet list would hold

  void begin_traversal() {
    front.clear();
    unexpanded.clear();
    group_pairs = listable = ended = culled = flat = 0;
  }
};

}  // namespace lazyccd
