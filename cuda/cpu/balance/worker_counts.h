// What one worker's part of a run cost, or all of them together.
#pragma once

#include <cstdint>

namespace lazyccd {

struct WorkerCounts {
  std::uint64_t steals = 0;     // batches taken from another worker
  std::uint64_t overflows = 0;  // times that items stayed with their worker for want of room
  std::uint64_t rounds = 0;     // balancing steps that all workers met for
  double ms_waited = 0;         // for others' work

  WorkerCounts& operator+=(const WorkerCounts& o) {
    steals += o.steals;
    overflows += o.overflows;
    rounds += o.rounds;
    ms_waited += o.ms_waited;
    return *this;
  }
};

}  // namespace lazyccd
