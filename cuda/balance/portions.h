// Items in one array for all workers, which claim portions of them through one counter.
#pragma once

#include <cstdint>

#include "core/platform.h"

namespace lazyccd {

/// A range of items.
struct Portion {
  std::uint64_t first;
  std::uint32_t count;  // 0: nothing is left
};

/// One worker's claims on an array of items, whose number start() sets. Once a claim found nothing,
/// the worker does not touch the counter again: no items are added during a run.
class Claims {
 public:
  LAZYCCD_HD void start(std::uint64_t count) { count_ = count; }

  /// Claims the next `size` items, or what is left of them.
  template <class Atomics>
  LAZYCCD_HD Portion next(typename Atomics::template Cell<std::uint64_t>& claimed,
                          std::uint32_t size) {
    if (count_ == 0) return {0, 0};
    // Relaxed: the items were there before the run, and each index is given to one worker only.
    const std::uint64_t first = Atomics::fetch_add(claimed, std::uint64_t{size}, Atomics::relaxed);
    const std::uint64_t rest = first < count_ ? count_ - first : 0;
    if (rest == 0) count_ = 0;
    return {first, static_cast<std::uint32_t>(rest < size ? rest : size)};
  }

 private:
  std::uint64_t count_;  // number of items; 0 once all are claimed
};

}  // namespace lazyccd
