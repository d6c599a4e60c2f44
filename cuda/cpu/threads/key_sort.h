// Sort of indices by 64-bit keys, on all threads of a pool.
#pragma once

#include <cstddef>
#include <cstdint>

#include "cpu/threads/noinit_vector.h"
#include "cpu/threads/thread_pool.h"

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

  /// Sorts items [first, last), whose indices must ascend. Uses all threads.
  void sort(std::size_t first, std::size_t last, ThreadPool& pool);
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

}  // namespace lazyccd
