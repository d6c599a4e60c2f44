// Statistics of a balanced run, for one worker or summed over all.
#pragma once

#include <cstdint>

namespace lazyccd {

struct WorkerCounts {
  std::uint64_t steals = 0;     // batches taken from another worker
  std::uint64_t overflows = 0;  // times that items stayed with their worker for lack of room
  std::uint64_t rounds = 0;     // balancing steps in which all workers met
  double ms_waited = 0;         // time spent waiting for the work of others, milliseconds

  WorkerCounts& operator+=(const WorkerCounts& o) {
    steals += o.steals;
    overflows += o.overflows;
    rounds += o.rounds;
    ms_waited += o.ms_waited;
    return *this;
  }
};

}  // namespace lazyccd
