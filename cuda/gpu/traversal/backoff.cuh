// How the first warp of a block waits for others' work: longer and longer, so that many who wait
// leave the memory to those who work.
#pragma once

#include "balance/device_atomics.cuh"
#include "balance/termination.h"
#include "gpu/device/kernel_chain.cuh"

namespace lazyccd::gpu {

class SpinWait {
 public:
  __device__ void pause() {
    __nanosleep(pause_ns_);
    pause_ns_ = min(2 * pause_ns_, longest_ns);
  }

 private:
  static constexpr unsigned shortest_ns = 32, longest_ns = 512;
  unsigned pause_ns_ = shortest_ns;
};

// For a whole warp. The looks are relaxed: an acquire would empty the L1 cache of a multiprocessor
// where other blocks still work. It comes with a count that looks like zero.
__device__ inline bool all_done(Termination<DeviceAtomics> termination) {
  bool over = false;
  if (threadIdx.x % kWarp == 0) over = termination.seems_over() && termination.over();
  return __shfl_sync(kAllLanes, over, 0);
}

}  // namespace lazyccd::gpu
