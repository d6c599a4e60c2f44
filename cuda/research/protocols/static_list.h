// Static lists with a balancing step, after gProximity (Lauterbach, Mo and Manocha 2010; da Silva,
// Algorithms 3.1 to 3.4). Each worker processes a list of its own. No items move between workers
// until a certain number of lists is empty. Then all workers stop, what is left is divided into
// even parts, and the next round begins.
#pragma once

#include <cstdint>

#include "core/platform.h"

namespace lazyccd::research {

/// Decides when the workers of a round stop. A view; zeroed memory is the start of a round.
template <class Atomics>
class RoundEnd {
 public:
  using Cell = typename Atomics::template Cell<std::uint32_t>;

  LAZYCCD_HD RoundEnd(Cell& idle, Cell& stop, std::uint32_t threshold)
      : idle_(&idle), stop_(&stop), threshold_(threshold) {}

  /// Counts a worker whose list is empty. Stops the round at the threshold.
  ///
  /// Relaxed throughout: only a request to stop. The end of the round publishes the lists.
  LAZYCCD_HD void ran_dry() {
    if (Atomics::fetch_add(*idle_, 1u, Atomics::relaxed) + 1 >= threshold_) stop();
  }
  LAZYCCD_HD void stop() { Atomics::store(*stop_, 1u, Atomics::relaxed); }
  LAZYCCD_HD bool stopped() const { return Atomics::load(*stop_, Atomics::relaxed) != 0; }

 private:
  Cell* idle_;
  Cell* stop_;
  std::uint32_t threshold_;  // number of workers
};

/// A worker's even part of `total` items: total / workers, plus one for the first total % workers
/// workers.
struct EvenPart {
  std::uint64_t first, count;
};
LAZYCCD_HD inline EvenPart even_part(std::uint64_t total, std::uint32_t worker,
                                     std::uint32_t workers) {
  const std::uint64_t share = total / workers, extra = total % workers;
  return {worker * share + (worker < extra ? worker : extra), share + (worker < extra ? 1 : 0)};
}

/// One worker's list, as the balancing step reads it.
template <class Item>
struct ItemList {
  const Item* items;
  std::uint64_t count;
};

/// The balancing step of one worker. Takes its even part of all lists laid end to end and passes it
/// to append(items, count), in one or more pieces.
template <class Item, class Append>
void take_even_part(const ItemList<Item>* lists, std::uint32_t list_count, std::uint32_t worker,
                    std::uint32_t workers, Append&& append) {
  std::uint64_t total = 0;
  for (std::uint32_t i = 0; i < list_count; ++i) total += lists[i].count;
  auto [skip, wanted] = even_part(total, worker, workers);
  for (std::uint32_t i = 0; i < list_count && wanted != 0; ++i) {
    if (skip >= lists[i].count) {
      skip -= lists[i].count;
      continue;
    }
    const std::uint64_t rest = lists[i].count - skip;
    const std::uint64_t count = rest < wanted ? rest : wanted;
    append(lists[i].items + skip, count);
    wanted -= count;
    skip = 0;
  }
}

}  // namespace lazyccd::research
