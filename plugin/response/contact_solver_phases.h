// How the parts of a contact solver's problem are spread over threads.
#pragma once

#include "response/contact_solver.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

// With fewer chunks or blocks a second thread costs more than it saves.
inline constexpr std::size_t min_parallel_items = 8;

template <class Each>
void ContactSolver::for_each(std::size_t count, const Each& each) const {
  const Threads& threads = count < min_parallel_items ? serial_ : threads_;
  threads.run_phases(count, each, [] { return std::size_t{0}; });
}

template <class Each, class AfterColour>
void ContactSolver::for_each_block_by_colour(const Each& each, const AfterColour& after_colour) {
  int colour = -1;
  const auto next = [&]() -> std::size_t {
    if (colour >= 0 && colour != BlockColours::overflow) after_colour(blocks_of_colour_[colour]);
    do {
      if (++colour == BlockColours::count) return 0;
    } while (blocks_of_colour_[colour].empty());
    return colour == BlockColours::overflow ? 1 : blocks_of_colour_[colour].size();
  };
  const auto run = [&](std::size_t item, int worker) {
    if (colour != BlockColours::overflow)
      return each(blocks_[blocks_of_colour_[colour][item]], worker);
    for (const std::int32_t block : blocks_of_colour_[colour]) {
      each(blocks_[block], worker);
      after_colour({block});
    }
  };
  const Threads& threads = block_count_ < 2 * min_parallel_items ? serial_ : threads_;
  threads.run_phases(next(), run, next);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
