// Sort of indices by 64-bit keys, on all threads of a pool.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "host/threads/noinit_vector.h"
#include "host/threads/thread_pool.h"

namespace lazyccd {

/// An index and the key by which it is sorted.
struct KeyedIndex {
  std::uint64_t key;
  std::int32_t index;

  bool operator<(const KeyedIndex& o) const { return key != o.key ? key < o.key : index < o.index; }
};

/// Sorts parts of an array by key, and equal keys by index: a radix sort by the upper digits of the
/// keys, then a sort of each run in which these digits agree.
class KeySort {
 public:
  NoinitVector<KeyedIndex> items;

  /// Items [first, last).
  struct Part {
    std::size_t first, last;
  };

  /// Sorts items [first, last), whose indices must ascend. Uses all threads.
  void sort(std::size_t first, std::size_t last, ThreadPool& pool);
  /// Sorts disjoint parts, each as sort() would. part_of(i) returns the i-th Part.
  template <class PartOf>
  void sort_parts(std::size_t count, ThreadPool& pool, PartOf&& part_of);
  /// The same on the calling thread. Disjoint parts may be sorted at the same time, after
  /// prepare().
  void sort_alone(std::size_t first, std::size_t last);
  /// Allocates what sort_alone() needs.
  void prepare() { other_.resize(items.size()); }

  std::size_t bytes() const {
    return (items.capacity() + other_.capacity()) * sizeof(KeyedIndex) +
           counts_.capacity() * sizeof(std::uint32_t);
  }

 private:
  // Sorts `size` items from `first` on in chunks, which the threads of the pool share, if there is
  // one.
  void sort(std::size_t first, std::size_t size, std::size_t chunks, ThreadPool* pool,
            NoinitVector<std::uint32_t>& counts);

  NoinitVector<KeyedIndex> other_;
  NoinitVector<std::uint32_t> counts_;
};

template <class PartOf>
void KeySort::sort_parts(std::size_t count, ThreadPool& pool, PartOf&& part_of) {
  constexpr std::size_t large = 1 << 15;  // items of one of many parts that all threads sort
  const auto is_large = [count](const Part& part) {
    return count == 1 || part.last - part.first >= large;
  };
  prepare();
  const std::size_t pieces = 8 * static_cast<std::size_t>(pool.available());
  const std::size_t grain = std::clamp<std::size_t>(count / pieces, 1, 256);
  pool.parallel_for(count, grain, [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i)
      if (const Part part = part_of(i); !is_large(part)) sort_alone(part.first, part.last);
  });
  for (std::size_t i = 0; i < count; ++i)
    if (const Part part = part_of(i); is_large(part)) sort(part.first, part.last, pool);
}

}  // namespace lazyccd
