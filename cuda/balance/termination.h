// Detects the end of a traversal: no worker is busy and no chunk is published.
//
// The counter `live` holds one unit for each busy worker and one for each published chunk. Only a
// busy worker creates units. It counts a chunk before it publishes the chunk, and until then its
// own unit keeps `live` above zero. Therefore zero is final: once a worker has seen zero, no work
// is left. In some strategies an idle worker counts itself before it takes work. If `live` was
// zero, it finds none and takes its unit back.
//
// A run starts with all workers idle and the initial chunks counted. So it does not depend on all
// workers being present: the device may not have started a block, or a thread may still sleep.
#pragma once

#include <cstdint>

#include "core/platform.h"

namespace lazyccd {

/// A view of the counter `live`. When a chunk or a worker changes state:
///
///   an idle worker takes a chunk       the chunk's unit becomes the worker's: no call
///   a busy worker publishes a chunk    chunk_published(), before the push
///   a busy worker takes a chunk        unit_ended(): two units became one
///   a busy worker becomes idle         unit_ended()
template <class Atomics>
class Termination {
 public:
  using Counter = typename Atomics::template Cell<std::uint32_t>;

  LAZYCCD_HD explicit Termination(Counter& live) : live_(&live) {}

  LAZYCCD_HD void chunk_published() {
    // Relaxed: the push that follows is a release and keeps this before the decrement of any worker
    // that takes the chunk.
    Atomics::fetch_add(*live_, 1u, Atomics::relaxed);
  }
  LAZYCCD_HD void unit_ended() {
    // Release: pairs with the acquire in over(). A worker that leaves sees what this worker wrote.
    Atomics::fetch_sub(*live_, 1u, Atomics::release);
  }
  /// A cheap estimate of over(), by a relaxed load, for a worker that polls. If true, call over().
  LAZYCCD_HD bool seems_over() const { return Atomics::load(*live_, Atomics::relaxed) == 0; }
  /// Whether the run is over. If true, what all workers wrote is visible to the caller.
  LAZYCCD_HD bool over() const { return Atomics::load(*live_, Atomics::acquire) == 0; }

 private:
  Counter* live_;
};

}  // namespace lazyccd
