// A bounded deque of chunk ids for work stealing. Its owner pushes and pops ids at the bottom;
// thieves steal them at the top.
//
// Protocol. The indices `top` and `bottom` and a tag share one 64-bit word. The word changes only
// by compare-and-swap (CAS):
//   push    writes the id to the free slot at `bottom`, then CAS to {top, bottom + 1, tag + 1}
//   pop     reads the slot below `bottom`,              then CAS to {top, bottom - 1, tag}
//   steal   reads the slot at `top`,                    then CAS to {top + 1, bottom, tag}
// A pop or a steal reads its slot before the CAS. The id counts as taken only if the CAS succeeds.
//
// Why no id is taken twice or lost. Only push() adds ids, and every push increments the tag. While
// the tag stays the same, the deque only shrinks. So if the CAS finds the word that was loaded, the
// word did not change in between (no ABA problem). The slot that was read then holds the id that
// the CAS takes. The tag wraps after 2^32 pushes: a thief would have to stall for exactly that long
// between its load and its CAS.
//
// Memory orders. push() releases; pop() and steal() acquire, so the new holder of an id sees the
// contents of the chunk. steal() also releases, and load_word() acquires, so the owner overwrites a
// slot only after the thief has read it.
//
// The published algorithm (da Silva, Algorithms 3.9 to 3.13) compares only `top` when it steals. A
// thief that stalls there may take items that the owner has popped in the meantime.
//
// Model: tests/model/lazy_stealing.pml.
#pragma once

#include <cstdint>

#include "core/platform.h"

namespace lazyccd {

constexpr std::uint32_t no_chunk = 0xffffffffu;  ///< the id that means "none"

/// The state of a deque. `top` and `bottom` count modulo 2^16; their low bits are the slot in the
/// ring.
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

/// A view of one deque: it owns neither the word nor the ring. Zeroed memory is an empty deque.
///
/// Each operation is called by one thread. The deque moves ids only; the caller fills and copies
/// the chunks. A block of threads needs a barrier between filling a chunk and push(), and between
/// pop() or steal() and reading the chunk.
template <class Atomics>
class Deque {
 public:
  using Word = typename Atomics::template Cell<std::uint64_t>;
  using Slot = typename Atomics::template Cell<std::uint32_t>;
  static constexpr std::uint32_t max_capacity = 1u << 15;

  /// capacity: slots in the ring, a power of two, at most max_capacity.
  LAZYCCD_HD Deque(Word& word, Slot* ring, std::uint32_t capacity)
      : word_(&word), ring_(ring), mask_(capacity - 1) {}

  /// The number of ids. For the owner this is an upper bound, because other threads only remove
  /// ids. For other threads it is an estimate.
  LAZYCCD_HD std::uint32_t size() const {
    return DequeWord::unpack(Atomics::load(*word_, Atomics::relaxed)).size();
  }
  /// Owner only. Returns the current word, for has_room() and push().
  LAZYCCD_HD std::uint64_t load_word() const {
    // Acquire: pairs with the release of the steal() that freed the slot, so the thief has read it.
    return Atomics::load(*word_, Atomics::acquire);
  }
  /// Owner only. Whether push() has a free slot, by a word from load_word(). If true, it stays true
  /// until the owner pushes.
  LAZYCCD_HD bool has_room(std::uint64_t seen) const {
    return DequeWord::unpack(seen).size() <= mask_;
  }
  LAZYCCD_HD bool has_room() const { return has_room(load_word()); }

  /// Owner only. Publishes the id and everything that the owner wrote before. Requires has_room().
  LAZYCCD_HD void push(std::uint32_t chunk) { push(chunk, load_word()); }
  /// The same with `seen`, a word that load_word() returned since the owner's last push() or pop().
  /// Requires has_room(seen).
  LAZYCCD_HD void push(std::uint32_t chunk, std::uint64_t seen) {
    DequeWord word = DequeWord::unpack(seen);
    // Relaxed: published by the CAS below. A slot outside [top, bottom) belongs to the owner alone.
    Atomics::store(ring_[word.bottom & mask_], chunk, Atomics::relaxed);
    for (;;) {
      word = DequeWord::unpack(seen);
      ++word.bottom;
      ++word.tag;
      // Release: pairs with the acquire load in pop() and steal(). The thread that takes the id
      // sees the chunk and the slot. This also holds after other pops and steals, because they
      // continue the release sequence. Failure is relaxed: only thieves interfere, and the slot is
      // already the owner's.
      if (Atomics::compare_exchange(*word_, seen, word.pack(), Atomics::release, Atomics::relaxed))
        return;
    }
  }

  /// Owner only. Takes the newest id; no_chunk if the deque is empty.
  LAZYCCD_HD std::uint32_t pop() {
    // Acquire: pairs with the release of push(). The owner needs it too, because another thread
    // pushed the ids that are here at the start of a run.
    std::uint64_t seen = Atomics::load(*word_, Atomics::acquire);
    for (;;) {
      DequeWord word = DequeWord::unpack(seen);
      if (word.size() == 0) return no_chunk;
      --word.bottom;
      // Relaxed: ordered by the acquire above.
      const std::uint32_t chunk = Atomics::load(ring_[word.bottom & mask_], Atomics::relaxed);
      // Acquire on success and on failure, like the load above. No release: only this owner writes
      // to the slot that a pop frees.
      if (Atomics::compare_exchange(*word_, seen, word.pack(), Atomics::acquire, Atomics::acquire))
        return chunk;
    }
  }

  /// Any thread. Takes the oldest id; no_chunk if the deque is empty or another thread changed it
  /// meanwhile. The thief then tries the next victim instead of repeating.
  LAZYCCD_HD std::uint32_t steal() {
    // Acquire: pairs with the release of push().
    std::uint64_t seen = Atomics::load(*word_, Atomics::acquire);
    DequeWord word = DequeWord::unpack(seen);
    if (word.size() == 0) return no_chunk;
    // Relaxed: ordered by the acquire above. The slot may have been taken and reused since; then
    // the CAS fails.
    const std::uint32_t chunk = Atomics::load(ring_[word.top & mask_], Atomics::relaxed);
    ++word.top;
    // Release: pairs with the acquire in load_word(), so the slot is reused only after the load
    // above. Acquire: pairs with the release of push(), for the contents of the chunk.
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
