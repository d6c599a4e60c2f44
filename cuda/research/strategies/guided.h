// Guided self-scheduling between CPU threads: owns the memory that research/protocols/guided.h
// works on. One of the strategies of BalancedRun, which says what a strategy is.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "balance/host_atomics.h"
#include "cpu/strategies/work_stack.h"
#include "cpu/strategies/worker_counts.h"
#include "host/threads/spin_wait.h"
#include "research/protocols/guided.h"

namespace lazyccd::research {

template <class ItemType>
class Guided {
 public:
  using Item = ItemType;
  static constexpr bool everyone = false;

  /// list_size: largest number of items that a worker publishes as one list.
  explicit Guided(int workers, std::uint32_t list_size = 1024)
      : members_(static_cast<std::size_t>(workers)) {
    view_.workers = static_cast<std::uint32_t>(workers);
    view_.list_size = std::min(std::max(list_size, 1u), View::max_list_size);
    view_.least = 1;
    view_.most = std::numeric_limits<std::uint32_t>::max();
    unread_.reset(new typename View::template Spaced<std::uint32_t>[members_.size()]);
    lists_.reset(new Item[members_.size() * view_.list_size]);
    view_.counters = &counters_;
    view_.unread = unread_.get();
    view_.lists = lists_.get();
  }

  void start(const Item* initial, std::size_t count) {
    view_.initial = initial;
    view_.initial_count = count;
    // Relaxed throughout: the start of the job publishes it.
    const auto set = [](auto& spaced, auto value) {
      HostAtomics::store(spaced.cell, value, HostAtomics::relaxed);
    };
    set(counters_.live, 1u);  // unit of the initial list
    for (auto* word : {&counters_.claimed, &counters_.shared_list}) set(*word, std::uint64_t{0});
    for (auto* word : {&counters_.list_lock, &counters_.idle_workers, &counters_.cancelled})
      set(*word, 0u);
    for (std::uint32_t i = 0; i < view_.workers; ++i) set(unread_[i], 0u);
    for (Member& m : members_) m.counts = {};
  }

  void arrive(int worker) {
    member(worker).protocol.arrive(view_, static_cast<std::uint32_t>(worker));
  }

  /// Fills the empty stack, waiting if needed. False: the run is over or cancelled.
  bool take(int worker, WorkStack<Item>& stack) {
    Member& m = member(worker);
    SpinWait waiting(m.counts.ms_waited);
    for (;;) {
      const Batch<Item> batch = m.protocol.claim();
      if (batch.count != 0) {
        stack.push(batch.items, batch.count);
        m.protocol.release(batch);
        return true;
      }
      if (m.protocol.over() || m.protocol.cancelled()) return false;
      waiting.pause();
    }
  }

  bool should_share(int worker, const WorkStack<Item>& stack) const {
    return stack.size() > 1 && member(worker).protocol.asked();
  }

  /// Publishes every second one of the oldest items as the next list. False: the run is cancelled.
  bool share(int worker, WorkStack<Item>& stack) {
    Member& m = member(worker);
    if (m.protocol.cancelled()) return false;
    if (Item* list = m.protocol.new_list()) {
      const std::size_t count = std::min<std::size_t>(stack.size() / 2, view_.list_size);
      stack.take_every_second(list, count);
      m.protocol.publish(static_cast<std::uint32_t>(count));
    }
    return true;
  }

  void cancel(int worker) { member(worker).protocol.cancel(); }

  void leave(int worker) {
    Member& m = member(worker);
    m.counts.steals = m.protocol.steals();
    m.counts.overflows = m.protocol.overflows();
  }

  WorkerCounts counts(int worker) const { return member(worker).counts; }
  std::size_t bytes() const {
    return sizeof(*this) +
           members_.size() * (sizeof(Member) + sizeof(unread_[0]) + view_.list_size * sizeof(Item));
  }

 private:
  using View = GuidedView<HostAtomics, Item>;
  struct alignas(HostAtomics::spacing) Member {
    GuidedWorker<HostAtomics, Item> protocol;
    WorkerCounts counts;
  };

  Member& member(int worker) { return members_[static_cast<std::size_t>(worker)]; }
  const Member& member(int worker) const { return members_[static_cast<std::size_t>(worker)]; }

  typename View::Counters counters_;
  std::unique_ptr<typename View::template Spaced<std::uint32_t>[]> unread_;
  std::unique_ptr<Item[]> lists_;
  View view_{};
  std::vector<Member> members_;
};

}  // namespace lazyccd::research
