// Items that lie in one place for all workers, who take portions of them from one counter.
#pragma once

#include <cstdint>

#include "core/platform.h"

namespace lazyccd {

struct Portion {
  std::uint64_t first;
  std::uint32_t count;  // 0: nothing is left
};

// One worker's claims on `count` items, which start() names. Once it found nothing it does not ask
// again: nothing is added in a run.
class Claims {
 public:
  LAZYCCD_HD void start(std::uint64_t count) { count_ = count; }

  // The next `size` items, or what is left of them.
  template <class Atomics>
  LAZYCCD_HD Portion next(typename Atomics::template Cell<std::uint64_t>& claimed,
                          std::uint32_t size) {
    if (count_ == 0) return {0, 0};
    // Relaxed: the items were there before the run, and each index is handed out once.
    const std::uint64_t first = Atomics::fetch_add(claimed, std::uint64_t{size}, Atomics::relaxed);
    const std::uint64_t rest = first < count_ ? count_ - first : 0;
    if (rest == 0) count_ = 0;
    return {first, static_cast<std::uint32_t>(rest < size ? rest : size)};
  }

 private:
  std::uint64_t count_;  // 0: all are claimed
};

// Guided self-scheduling (Polychronopoulos and Kuck 1987): large portions first, so that few are
// taken, and single items at the end, so that all end together. Half of an even share leaves the
// other half for those whose items turn out to be light.
LAZYCCD_HD inline std::uint32_t guided_size(std::uint64_t rest, std::uint32_t workers) {
  constexpr std::uint64_t most = 1u << 16;
  const std::uint64_t size = rest / (2 * std::uint64_t{workers});
  return static_cast<std::uint32_t>(size < 1 ? 1 : size < most ? size : most);
}

}  // namespace lazyccd
