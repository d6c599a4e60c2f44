// Chunks of items and the pool of free chunks. The pool is a shared list of ids. Each worker has a
// small private cache in front of it, so hundreds of blocks do not contend for one word for every
// chunk.
#pragma once

#include <cstdint>

#include "balance/deque.h"
#include "core/platform.h"

namespace lazyccd {

/// An array of work items. Only the worker that owns the id of a chunk accesses it, so nothing here
/// is atomic.
template <class Item, std::uint32_t Size>
struct alignas(16) Chunk {
  static constexpr std::uint32_t capacity = Size;
  Item items[Size];
  std::uint32_t count;
};

/// The place of a batch of items. Valid until the worker releases the batch after copying it.
template <class Item>
struct Batch {
  const Item* items;
  std::uint32_t count;  // 0: no items
  std::uint32_t chunk;  // chunk that holds them; no_chunk if none does, as for initial items
};

/// The free ids out of [0, capacity): a lock-free stack, linked through `links`. The head is one
/// word {first id, tag}, and every change increments the tag. So a head that compares equal has not
/// changed: Treiber's stack without its ABA problem.
///
/// A view. Zeroed memory is a full list, because a link is stored as its difference from id + 1.
/// Model: tests/model/free_list.pml.
template <class Atomics>
class FreeList {
 public:
  using Head = typename Atomics::template Cell<std::uint64_t>;
  using Link = typename Atomics::template Cell<std::uint32_t>;

  LAZYCCD_HD FreeList(Head& head, Link* links, std::uint32_t capacity)
      : head_(&head), links_(links), capacity_(capacity) {}

  /// Takes up to `wanted` ids; returns how many.
  LAZYCCD_HD std::uint32_t take(std::uint32_t* ids, std::uint32_t wanted) {
    // Acquire: pairs with the release of give(). It makes the links visible, and orders the last
    // loads of the chunks' former owners before the stores of the new owner.
    std::uint64_t seen = Atomics::load(*head_, Atomics::acquire);
    for (;;) {
      std::uint32_t first = static_cast<std::uint32_t>(seen);
      std::uint32_t count = 0;
      // Other workers may change the links meanwhile. The values stay in range, and the CAS fails.
      while (count < wanted && first < capacity_) {
        ids[count++] = first;
        first += 1 + Atomics::load(links_[first], Atomics::relaxed);
      }
      if (count == 0) return 0;
      // Acquire on success and on failure, like the load above.
      if (Atomics::compare_exchange(*head_, seen, next_head(seen, first), Atomics::acquire,
                                    Atomics::acquire))
        return count;
    }
  }

  /// Returns `count` ids. Their chunks must not be read any more.
  LAZYCCD_HD void give(const std::uint32_t* ids, std::uint32_t count) {
    if (count == 0) return;
    for (std::uint32_t i = 0; i + 1 < count; ++i) link(ids[i], ids[i + 1]);
    // Relaxed: the id in the head is only copied here, not followed.
    std::uint64_t seen = Atomics::load(*head_, Atomics::relaxed);
    do {
      link(ids[count - 1], static_cast<std::uint32_t>(seen));
      // Release: pairs with the acquire in take(). The links are published, and all reads of the
      // chunks come before.
    } while (!Atomics::compare_exchange(*head_, seen, next_head(seen, ids[0]), Atomics::release,
                                        Atomics::relaxed));
  }

 private:
  LAZYCCD_HD static std::uint64_t next_head(std::uint64_t head, std::uint32_t first) {
    return ((head >> 32) + 1) << 32 | first;
  }
  LAZYCCD_HD void link(std::uint32_t id, std::uint32_t next) {
    // Relaxed: published by give()'s CAS.
    Atomics::store(links_[id], next - (id + 1), Atomics::relaxed);
  }

  Head* head_;
  Link* links_;
  std::uint32_t capacity_;  // also the id that marks the end of the list
};

/// The private free chunks of one worker. When empty or full, it exchanges half of its size with
/// the shared list. A trivial type, so it can be placed in a block's shared memory; call clear()
/// first.
template <std::uint32_t Size>
class ChunkCache {
 public:
  LAZYCCD_HD void clear() { count_ = 0; }

  /// Takes one id; no_chunk if none is free.
  template <class Atomics>
  LAZYCCD_HD std::uint32_t take(FreeList<Atomics> list) {
    if (count_ == 0) count_ = list.take(ids_, half);
    return count_ == 0 ? no_chunk : ids_[--count_];
  }
  template <class Atomics>
  LAZYCCD_HD void give(FreeList<Atomics> list, std::uint32_t id) {
    if (count_ == Size) {
      count_ -= half;
      list.give(ids_ + count_, half);
    }
    ids_[count_++] = id;
  }
  /// Returns all ids to the shared list.
  template <class Atomics>
  LAZYCCD_HD void flush(FreeList<Atomics> list) {
    list.give(ids_, count_);
    count_ = 0;
  }

 private:
  static constexpr std::uint32_t half = (Size + 1) / 2;
  std::uint32_t count_;
  std::uint32_t ids_[Size];
};

}  // namespace lazyccd
