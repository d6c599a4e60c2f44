// One list for all workers, taken in shrinking portions (balance/portions.h), without deque or
// theft. Once it is empty and somebody waits, a worker that has items gives half of them as the
// next list. One of the strategies of BalancedRun; see there for what a strategy is.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "balance/host_atomics.h"
#include "balance/portions.h"
#include "balance/termination.h"
#include "cpu/waiting.h"
#include "cpu/work_stack.h"
#include "cpu/worker_counts.h"

namespace lazyccd {

template <class ItemType>
class Guided {
 public:
  using Item = ItemType;
  static constexpr bool everyone = false;

  // list_size: items of a list that a worker gives.
  explicit Guided(int workers, std::uint32_t list_size = 1024)
      : list_size_(std::min<std::uint32_t>(std::max(list_size, 1u), longest_list)),
        members_(static_cast<std::size_t>(workers)) {
    for (Member& m : members_) m.list.reset(new Item[list_size_]);
  }

  void start(const Item* initial, std::size_t count) {
    initial_ = initial;
    count_ = count;
    // Relaxed throughout: the start of the job publishes it.
    HostAtomics::store(live_.value, 1u, HostAtomics::relaxed);  // of the initial list
    HostAtomics::store(claimed_.value, std::uint64_t{0}, HostAtomics::relaxed);
    HostAtomics::store(given_.value, std::uint64_t{0}, HostAtomics::relaxed);
    for (auto* cell : {&hungry_, &giving_, &cancelled_})
      HostAtomics::store(cell->value, 0u, HostAtomics::relaxed);
    for (Member& m : members_) {
      m.counts = {};
      HostAtomics::store(m.unread, 0u, HostAtomics::relaxed);
    }
  }

  void arrive(int worker) {
    member(worker).busy = false;
    // Relaxed, here and wherever hungry changes: it is a hint and publishes nothing.
    HostAtomics::fetch_add(hungry_.value, 1u, HostAtomics::relaxed);
  }
  void leave(int) {}

  // Fills the empty stack; false: the run is over or cancelled.
  bool take(int worker, WorkStack<Item>& stack) {
    Member& m = member(worker);
    Waiting waiting(m.counts.ms_waited);
    for (;;) {
      if (claim(m, stack)) return true;
      if (m.busy) {
        m.busy = false;
        HostAtomics::fetch_add(hungry_.value, 1u, HostAtomics::relaxed);
        termination().unit_ended();
      }
      if (termination().over() || cancelled()) return false;
      waiting.pause();
    }
  }

  bool should_share(int, const WorkStack<Item>& stack) const {
    // Relaxed: hints.
    return HostAtomics::load(hungry_.value, HostAtomics::relaxed) != 0 && stack.size() > 1 &&
           Given::unpack(HostAtomics::load(given_.value, HostAtomics::relaxed)).rest() == 0;
  }

  // Every second of the oldest items becomes the next list. False: the run is cancelled.
  bool share(int worker, WorkStack<Item>& stack) {
    if (cancelled()) return false;
    Member& m = member(worker);
    // Acquire, pairs with the releases in claim_given() and at the end of this function.
    std::uint32_t nobody = 0;
    if (HostAtomics::load(m.unread, HostAtomics::acquire) != 0 ||
        !HostAtomics::compare_exchange(giving_.value, nobody, 1u, HostAtomics::acquire,
                                       HostAtomics::relaxed)) {
      ++m.counts.overflows;
      return true;
    }
    // Only who gives makes it longer, so what is empty now stays so.
    if (Given::unpack(HostAtomics::load(given_.value, HostAtomics::relaxed)).rest() == 0) {
      const std::size_t count = std::min<std::size_t>(stack.size() / 2, list_size_);
      stack.take_every_second(m.list.get(), count);
      HostAtomics::store(m.unread, static_cast<std::uint32_t>(count), HostAtomics::relaxed);
      termination().chunk_published();
      const Given given{static_cast<std::uint32_t>(worker), 0, static_cast<std::uint32_t>(count)};
      // Release, pairs with the acquire in claim(): the items.
      HostAtomics::store(given_.value, given.pack(), HostAtomics::release);
    }
    HostAtomics::store(giving_.value, 0u, HostAtomics::release);
    return true;
  }

  void cancel(int) { HostAtomics::store(cancelled_.value, 1u, HostAtomics::relaxed); }

  WorkerCounts counts(int worker) const { return member(worker).counts; }
  std::size_t bytes() const {
    return sizeof(*this) + members_.size() * (sizeof(Member) + list_size_ * sizeof(Item));
  }

 private:
  static constexpr std::uint32_t longest_list = std::numeric_limits<std::uint16_t>::max();

  // Whose list it is and which part of it is still there. Whoever exchanges the word owns the
  // portion, however often the same word has come and gone.
  struct Given {
    std::uint32_t worker, next, end;

    static Given unpack(std::uint64_t bits) {
      return {static_cast<std::uint32_t>(bits >> 32),
              static_cast<std::uint32_t>(bits >> 16 & 0xffff),
              static_cast<std::uint32_t>(bits & 0xffff)};
    }
    std::uint64_t pack() const { return std::uint64_t{worker} << 32 | next << 16 | end; }
    std::uint32_t rest() const { return end - next; }
  };

  template <class T>
  struct alignas(HostAtomics::spacing) Cell {
    HostAtomics::Cell<T> value{0};
  };
  struct alignas(HostAtomics::spacing) Member {
    std::unique_ptr<Item[]> list;
    HostAtomics::Cell<std::uint32_t> unread{0};  // items of the list that nobody has copied yet
    bool busy = false;                           // holds a unit of `live`
    WorkerCounts counts;
  };

  Member& member(int worker) { return members_[static_cast<std::size_t>(worker)]; }
  const Member& member(int worker) const { return members_[static_cast<std::size_t>(worker)]; }
  Termination<HostAtomics> termination() { return Termination<HostAtomics>(live_.value); }
  bool cancelled() const { return HostAtomics::load(cancelled_.value, HostAtomics::relaxed) != 0; }

  // A portion of either list. Each list that is not used up holds one unit of `live`, which ends
  // with its last portion. A worker counts itself before it claims: the last portion may be
  // another's, and be done with first.
  bool claim(Member& m, WorkStack<Item>& stack) {
    // Relaxed: hints.
    if (HostAtomics::load(claimed_.value, HostAtomics::relaxed) >= count_ &&
        Given::unpack(HostAtomics::load(given_.value, HostAtomics::relaxed)).rest() == 0)
      return false;
    if (!m.busy) termination().chunk_published();
    const bool found = claim_initial(stack) || claim_given(m, stack);
    if (found && !m.busy) {
      m.busy = true;
      HostAtomics::fetch_sub(hungry_.value, 1u, HostAtomics::relaxed);
    } else if (!found && !m.busy) {
      termination().unit_ended();
    }
    return found;
  }

  bool claim_initial(WorkStack<Item>& stack) {
    // Relaxed: the items were there before the run.
    std::uint64_t seen = HostAtomics::load(claimed_.value, HostAtomics::relaxed);
    while (seen < count_) {
      const std::uint32_t size = guided_size(count_ - seen, workers());
      if (!HostAtomics::compare_exchange(claimed_.value, seen, seen + size, HostAtomics::relaxed,
                                         HostAtomics::relaxed))
        continue;
      stack.push(initial_ + seen, size);
      if (seen + size == count_) termination().unit_ended();
      return true;
    }
    return false;
  }

  bool claim_given(Member& thief, WorkStack<Item>& stack) {
    // Acquire, pairs with the release in share(): the items, also through other claims, which
    // continue the release sequence.
    std::uint64_t seen = HostAtomics::load(given_.value, HostAtomics::acquire);
    for (;;) {
      Given given = Given::unpack(seen);
      if (given.rest() == 0) return false;
      const std::uint32_t size = guided_size(given.rest(), workers()), first = given.next;
      given.next += size;
      if (!HostAtomics::compare_exchange(given_.value, seen, given.pack(), HostAtomics::acquire,
                                         HostAtomics::acquire))
        continue;
      Member& giver = members_[given.worker];
      stack.push(giver.list.get() + first, size);
      // Release, pairs with the acquire in share(): the portion has been copied.
      HostAtomics::fetch_sub(giver.unread, size, HostAtomics::release);
      if (&giver != &thief) ++thief.counts.steals;
      if (given.rest() == 0) termination().unit_ended();
      return true;
    }
  }

  std::uint32_t workers() const { return static_cast<std::uint32_t>(members_.size()); }

  std::uint32_t list_size_;
  std::vector<Member> members_;
  const Item* initial_ = nullptr;
  std::size_t count_ = 0;
  Cell<std::uint32_t> live_, hungry_, giving_, cancelled_;
  Cell<std::uint64_t> claimed_, given_;
};

}  // namespace lazyccd
