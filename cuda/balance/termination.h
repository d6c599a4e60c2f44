// When is a traversal over? When no worker is busy and no chunk is published.
//
// `live` counts both. Only a busy worker creates units, and it counts a chunk before it publishes
// it, so the worker's own unit keeps `live` above zero meanwhile: zero, once seen, is for ever. A
// run starts with every worker idle and the initial chunks counted, so it does not depend on all
// workers being there (a block that the device has not started yet, a thread that has not woken
// up).
#pragma once

#include <cstdint>

#include "core/platform.h"

namespace lazyccd {

// A view over one cell. Which transfers count, and which are free:
//   an idle worker takes a chunk       the chunk's unit becomes the worker's: nothing to do
//   a busy worker publishes a chunk    chunk_published(), before the push
//   a busy worker takes a chunk        unit_ended(): two units became one
//   a busy worker goes idle            unit_ended()
template <class Atomics>
class Termination {
 public:
  using Counter = typename Atomics::template Cell<std::uint32_t>;

  LAZYCCD_HD explicit Termination(Counter& live) : live_(&live) {}

  LAZYCCD_HD void chunk_published() {
    // Relaxed: the push that follows, a release, keeps it before any taker's decrement.
    Atomics::fetch_add(*live_, 1u, Atomics::relaxed);
  }
  LAZYCCD_HD void unit_ended() {
    // Release, pairs with the acquire in over(): what the worker wrote is visible to who leaves.
    Atomics::fetch_sub(*live_, 1u, Atomics::release);
  }
  // Relaxed: for a worker that looks often and asks over() where it says yes.
  LAZYCCD_HD bool seems_over() const { return Atomics::load(*live_, Atomics::relaxed) == 0; }
  LAZYCCD_HD bool over() const { return Atomics::load(*live_, Atomics::acquire) == 0; }

 private:
  Counter* live_;
};

}  // namespace lazyccd
