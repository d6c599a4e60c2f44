// A bounded deque of chunk ids: its owner pushes and pops at the bottom, thieves steal at the top.
//
// Published lazy stealing (da Silva, Algorithms 3.9 to 3.13) compares only `top` when it steals, so
// a thief that stalls may take what the owner has popped meanwhile. Here top, bottom and a tag
// share one 64-bit word that changes only by CAS, and every push bumps the tag. While the tag
// stands still, no id comes in and the deque only shrinks; so a word that is equal again was never
// different, and the slot a thief read before its CAS is the one that it wins. (The tag wraps after
// 2^32 pushes: a thief would have to stall that long between its load and its CAS.) Model:
// tests/model/lazy_stealing.pml.
#pragma once

#include <cstdint>

#include "core/platform.h"

namespace lazyccd {

constexpr std::uint32_t no_chunk = 0xffffffffu;

// `top` and `bottom` count modulo 2^16; the ring's slots are their low bits.
struct DequeWord {
  std::uint16_t top, bottom;
  std::uint32_t tag;

  LAZYCCD_HD static DequeWord unpack(std::uint64_t bits) {
    return {static_cast<std::uint16_t>(bits), static_cast<std::uint16_t>(bits >> 16),
            static_cast<std::uint32_t>(bits >> 32)};
  }
  LAZYCCD_HD std::uint64_t pack() const {
    return std::uint64_t{tag} << 32 | std::uint64_t{bottom} << 16 | top;
  }
  LAZYCCD_HD std::uint32_t size() const { return static_cast<std::uint16_t>(bottom - top); }
};

// A view: it owns neither word nor ring. Zeroed memory is an empty deque. Each operation is for one
// thread; who fills and who copies the chunk is the caller's business (a block puts a barrier
// between filling and push, and between steal or pop and reading).
template <class Atomics>
class Deque {
 public:
  using Word = typename Atomics::template Cell<std::uint64_t>;
  using Slot = typename Atomics::template Cell<std::uint32_t>;
  static constexpr std::uint32_t max_capacity = 1u << 15;

  // capacity: slots in the ring, a power of two up to max_capacity.
  LAZYCCD_HD Deque(Word& word, Slot* ring, std::uint32_t capacity)
      : word_(&word), ring_(ring), mask_(capacity - 1) {}

  // A guess for anyone; for the owner never less than the truth, since others only take.
  LAZYCCD_HD std::uint32_t size() const {
    return DequeWord::unpack(Atomics::load(*word_, Atomics::relaxed)).size();
  }
  // Owner only: what push() starts from.
  LAZYCCD_HD std::uint64_t look() const {
    // Acquire, pairs with the release of the steal that freed the slot: the thief has read it.
    return Atomics::load(*word_, Atomics::acquire);
  }
  // For the owner: true stays true until it pushes.
  LAZYCCD_HD bool has_room(std::uint64_t seen) const {
    return DequeWord::unpack(seen).size() <= mask_;
  }
  LAZYCCD_HD bool has_room() const { return has_room(look()); }

  // Owner only, where has_room() by a look since its last push or pop. Publishes what the owner
  // wrote before.
  LAZYCCD_HD void push(std::uint32_t chunk) { push(chunk, look()); }
  LAZYCCD_HD void push(std::uint32_t chunk, std::uint64_t seen) {
    DequeWord word = DequeWord::unpack(seen);
    // Relaxed: published by the CAS below. A slot outside [top, bottom) is the owner's alone.
    Atomics::store(ring_[word.bottom & mask_], chunk, Atomics::relaxed);
    for (;;) {
      word = DequeWord::unpack(seen);
      ++word.bottom;
      ++word.tag;
      // Release, pairs with the acquire load in pop() and steal(): chunk and slot are visible to
      // who takes them, also through later pops and steals, which continue the release sequence.
      // Failure relaxed: only thieves interfere, the slot is already the owner's.
      if (Atomics::compare_exchange(*word_, seen, word.pack(), Atomics::release, Atomics::relaxed))
        return;
    }
  }

  // Owner only. The newest chunk, or no_chunk where the deque is empty.
  LAZYCCD_HD std::uint32_t pop() {
    // Acquire, pairs with the release of push(): the chunks that are here at the start of a run
    // were pushed by another thread.
    std::uint64_t seen = Atomics::load(*word_, Atomics::acquire);
    for (;;) {
      DequeWord word = DequeWord::unpack(seen);
      if (word.size() == 0) return no_chunk;
      --word.bottom;
      // Relaxed: ordered by the acquire above.
      const std::uint32_t chunk = Atomics::load(ring_[word.bottom & mask_], Atomics::relaxed);
      // Acquire on success and failure: as the load above. No release: the slot that a pop frees is
      // written next by this same owner.
      if (Atomics::compare_exchange(*word_, seen, word.pack(), Atomics::acquire, Atomics::acquire))
        return chunk;
    }
  }

  // Anyone. The oldest chunk, or no_chunk where the deque is empty or another was faster: the thief
  // goes on to the next victim instead of insisting.
  LAZYCCD_HD std::uint32_t steal() {
    // Acquire, pairs with the release of push().
    std::uint64_t seen = Atomics::load(*word_, Atomics::acquire);
    DequeWord word = DequeWord::unpack(seen);
    if (word.size() == 0) return no_chunk;
    // Relaxed: ordered by the acquire above. It may read a slot that is no longer this deque's, and
    // then the CAS fails.
    const std::uint32_t chunk = Atomics::load(ring_[word.top & mask_], Atomics::relaxed);
    ++word.top;
    // Release, pairs with the acquire in push(): the slot is reused only after the load above.
    // Acquire pairs with the release of push(): the chunk's contents.
    if (Atomics::compare_exchange(*word_, seen, word.pack(), Atomics::acq_rel, Atomics::relaxed))
      return chunk;
    return no_chunk;
  }

 private:
  Word* word_;
  Slot* ring_;
  std::uint32_t mask_;
};

}  // namespace lazyccd
