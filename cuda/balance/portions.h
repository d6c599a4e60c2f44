// Items that lie in one place for all workers, who take portions of them from one counter.
#pragma once

#include <cstdint>

#include "core/platform.h"

namespace lazyccd {

struct Portion {
  std::uint64_t first;
  std::uint32_t count;  // 0: nothing is left
};

// The next `size` of `count` items, or what is left of them.
template <class Atomics>
LAZYCCD_HD Portion claim_portion(typename Atomics::template Cell<std::uint64_t>& claimed,
                                 std::uint64_t count, std::uint32_t size) {
  // Relaxed: the items were there before the run, and each index is handed out once. The look
  // before the step keeps the counter from running on.
  if (Atomics::load(claimed, Atomics::relaxed) >= count) return {0, 0};
  const std::uint64_t first = Atomics::fetch_add(claimed, std::uint64_t{size}, Atomics::relaxed);
  if (first >= count) return {0, 0};
  const std::uint64_t rest = count - first;
  return {first, static_cast<std::uint32_t>(rest < size ? rest : size)};
}

// Guided self-scheduling (Polychronopoulos and Kuck 1987): large portions first, so that few are
// taken, and single items at the end, so that all end together. Half of an even share leaves the
// other half for those whose items turn out to be light.
LAZYCCD_HD inline std::uint32_t guided_size(std::uint64_t rest, std::uint32_t workers) {
  constexpr std::uint64_t most = 1u << 16;
  const std::uint64_t size = rest / (2 * std::uint64_t{workers});
  return static_cast<std::uint32_t>(size < 1 ? 1 : size < most ? size : most);
}

}  // namespace lazyccd
