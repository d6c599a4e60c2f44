// Chunks of items, and where free ones wait: a shared list of ids, and in front of it a small
// private cache a worker, so that hundreds of blocks do not meet at one word for every chunk.
#pragma once

#include <cstdint>

#include "balance/deque.h"
#include "core/platform.h"

namespace lazyccd {

// Work items side by side. Only the worker that owns the id touches it, so nothing here is atomic.
template <class Item, std::uint32_t Size>
struct alignas(16) Chunk {
  static constexpr std::uint32_t capacity = Size;
  Item items[Size];
  std::uint32_t count;
};

// Where a worker finds a batch of items, valid until it says that it has copied them.
template <class Item>
struct Batch {
  const Item* items;
  std::uint32_t count;  // 0: none
  std::uint32_t chunk;  // that holds them; no_chunk: none, such as with items of the start
};

// A stack of the ids [0, capacity), linked through `next`. The head is one word {first id, tag};
// every change bumps the tag, so a head that is equal again was never different (Treiber's stack
// without its ABA). A view: zeroed memory is a full list, because a link is stored as its distance
// from id + 1.
template <class Atomics>
class FreeList {
 public:
  using Head = typename Atomics::template Cell<std::uint64_t>;
  using Link = typename Atomics::template Cell<std::uint32_t>;

  LAZYCCD_HD FreeList(Head& head, Link* links, std::uint32_t capacity)
      : head_(&head), links_(links), capacity_(capacity) {}

  // Up to `wanted` ids; returns how many.
  LAZYCCD_HD std::uint32_t take(std::uint32_t* ids, std::uint32_t wanted) {
    // Acquire, pairs with the release of give(): the links, and the last loads of the chunks'
    // former owners come before what the new owner writes.
    std::uint64_t seen = Atomics::load(*head_, Atomics::acquire);
    for (;;) {
      std::uint32_t first = static_cast<std::uint32_t>(seen);
      std::uint32_t count = 0;
      // Others may change the links meanwhile; they stay in range, and then the CAS fails.
      while (count < wanted && first < capacity_) {
        ids[count++] = first;
        first += 1 + Atomics::load(links_[first], Atomics::relaxed);
      }
      if (count == 0) return 0;
      // Acquire on success and failure: as the load above.
      if (Atomics::compare_exchange(*head_, seen, successor(seen, first), Atomics::acquire,
                                    Atomics::acquire))
        return count;
    }
  }

  LAZYCCD_HD void give(const std::uint32_t* ids, std::uint32_t count) {
    if (count == 0) return;
    for (std::uint32_t i = 0; i + 1 < count; ++i) link(ids[i], ids[i + 1]);
    // Relaxed: the head's id is only copied, never followed here.
    std::uint64_t seen = Atomics::load(*head_, Atomics::relaxed);
    do {
      link(ids[count - 1], static_cast<std::uint32_t>(seen));
      // Release, pairs with the acquire in take(): the links, and the chunks are no longer read.
    } while (!Atomics::compare_exchange(*head_, seen, successor(seen, ids[0]), Atomics::release,
                                        Atomics::relaxed));
  }

 private:
  LAZYCCD_HD static std::uint64_t successor(std::uint64_t head, std::uint32_t first) {
    return ((head >> 32) + 1) << 32 | first;
  }
  LAZYCCD_HD void link(std::uint32_t id, std::uint32_t next) {
    // Relaxed: published by give()'s CAS.
    Atomics::store(links_[id], next - (id + 1), Atomics::relaxed);
  }

  Head* head_;
  Link* links_;
  std::uint32_t capacity_;  // also the id that ends the list
};

// One worker's own free chunks. Refills and spills half at a time. Trivial, so that it can lie in a
// block's shared memory: call clear() first.
template <std::uint32_t Size>
class ChunkCache {
 public:
  LAZYCCD_HD void clear() { count_ = 0; }

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
