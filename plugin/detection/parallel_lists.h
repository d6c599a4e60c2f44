// Lists of items by number, which several threads make at the same time. For example, the contacts
// of each vertex. The order within a list depends on the threads, so what is done with a list must
// not depend on it.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "lazyccd/bullet/precision.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Singly linked lists of items. Both are numbered from 0. Keeps its memory.
class ParallelLists {
 public:
  static constexpr std::int32_t none = -1;

  /// Makes room for so many lists and items. If lists are added, all are empty afterwards.
  void reserve(std::size_t lists, std::size_t items) {
    if (next_.size() < items) next_.resize(items);
    if (lists <= list_count_) return;
    const std::size_t count = std::max(lists, 2 * list_count_);
    first_ = std::make_unique<std::atomic<std::int32_t>[]>(count);
    list_count_ = count;
    empty_first(list_count_);
  }
  std::size_t list_count() const { return list_count_; }
  /// Empties the lists with a number below `count`.
  void empty_first(std::size_t count) {
    for (std::size_t list = 0; list < count; ++list) empty(list);
  }

  // Several threads may call these at the same time, for different items. Memory accesses may be
  // in any order, because the end of Threads::parallel_for() makes them visible.

  void add(std::size_t list, std::int32_t item) {
    next(item) = first_[list].exchange(item, std::memory_order_relaxed);
  }
  void empty(std::size_t list) { first_[list].store(none, std::memory_order_relaxed); }
  /// An item of the list, or none.
  std::int32_t first(std::size_t list) const {
    return first_[list].load(std::memory_order_relaxed);
  }
  /// The item behind this one in its list, or none.
  std::int32_t& next(std::int32_t item) { return next_[static_cast<std::size_t>(item)]; }
  std::int32_t next(std::int32_t item) const { return next_[static_cast<std::size_t>(item)]; }
  /// Whether the list has more items than this one.
  bool has_others(std::size_t list, std::int32_t item) const {
    return first(list) != item || next(item) != none;
  }

 private:
  std::size_t list_count_ = 0;
  std::unique_ptr<std::atomic<std::int32_t>[]> first_;  // by list
  std::vector<std::int32_t> next_;                      // by item
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
