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
  // Pairs of groups visited that do not both rest, pairs where the traversal ended, pairs culled by
  // the volume, and nodes culled by the normal cone.
  std::int64_t group_pairs = 0, ended = 0, culled = 0, flat = 0;
  std::int64_t listable = 0;  // number of group_pairs that a Verlet list would hold
  double ms_busy = 0;         // Strategy::thread_per_query: time in the traversal, milliseconds

  void begin_traversal() {
    front.clear();
    unexpanded.clear();
    group_pairs = listable = ended = culled = flat = 0;
    ms_busy = 0;
  }
};

}  // namespace lazyccd
