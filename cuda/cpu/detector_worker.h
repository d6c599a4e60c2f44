// One thread's part of a detection on the CPU.
#pragma once

#include <cstdint>
#include <vector>

#include "core/node_pair.h"
#include "cpu/cpu_detector.h"
#include "cpu/narrow/narrow_phase.h"

namespace lazyccd {

// Of the traversal, with the narrow phase behind it.
struct alignas(128) CpuDetector::Worker : NarrowPhase {
  std::vector<NodePair> front, unexpanded;
  std::int64_t group_pairs = 0, ended = 0, culled = 0, flat = 0;
  std::int64_t lasting = 0;  // of group_pairs, those that a list would hold for
  double ms_busy = 0;

  void begin_traversal() {
    front.clear();
    unexpanded.clear();
    group_pairs = lasting = ended = culled = flat = 0;
    ms_busy = 0;
  }
};

}  // namespace lazyccd
