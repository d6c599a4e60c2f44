// Waiting of a block's first warp for the work of other blocks. The pauses grow longer, so that
// many waiting warps leave the memory to the working ones.
#pragma once

#include "balance/device_atomics.cuh"
#include "balance/termination.h"
#include "gpu/device/kernel_chain.cuh"

namespace lazyccd::gpu {

/// Pauses that double from 32 ns to 512 ns.
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

/// Returns whether the traversal is over; for a whole warp. It polls with relaxed loads: an acquire
/// would empty the L1 cache of a multiprocessor on which other blocks still work. The acquire comes
/// once the count looks like zero.
__device__ inline bool all_done(Termination<DeviceAtomics> termination) {
  bool over = false;
  if (threadIdx.x % kWarp == 0) over = termination.seems_over() && termination.over();
  return __shfl_sync(kAllLanes, over, 0);
}

}  // namespace lazyccd::gpu
