// Lazy work stealing as published (da Silva, section 3.4) between CPU threads: owns the memory that
// research/protocols/greedy_stealing.h works on. One of the strategies of BalancedRun, which says
// what a strategy is.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "balance/host_atomics.h"
#include "cpu/strategies/work_stack.h"
#include "cpu/strategies/worker_counts.h"
#include "host/threads/spin_wait.h"
#include "research/protocols/greedy_stealing.h"

namespace lazyccd::research {

template <class ItemType, std::uint32_t BatchSize = 256>
class GreedyStealing {
 public:
  using Item = ItemType;
  static constexpr bool everyone = false;

  /// stack_size: items of a worker's own stack beyond which `batch_size` of them (at most
  /// BatchSize) go to its deque. batches: batches per worker, a power of two. 0: the defaults.
  /// These are small, because a depth-first traversal by one thread never has many items, and other
  /// workers get only what it offers.
  explicit GreedyStealing(int workers, std::uint32_t stack_size = 0, std::uint32_t batch_size = 0,
                          std::uint32_t batches = 0)
      : stack_size_(stack_size != 0 ? stack_size : 8),
        batch_size_(std::min(batch_size != 0 ? batch_size : 4, BatchSize)),
        members_(static_cast<std::size_t>(workers)) {
    const auto count = static_cast<std::uint32_t>(workers);
    if (batches == 0) batches = 16;
    deque_words_.reset(new typename View::template Spaced<std::uint64_t>[count]);
    rings_.reset(new Slot[std::size_t{count} * batches]);
    in_use_.reset(new Slot[std::size_t{count} * batches]);
    chunks_.reset(new Chunk<Item, BatchSize>[std::size_t{count} * batches]);
    won_.reset(new std::uint32_t[std::size_t{count} * count]);
    view_ = {count,         batches,
             &counters_,    deque_words_.get(),
             rings_.get(),  in_use_.get(),
             chunks_.get(), won_.get(),
             nullptr,       0};
    reset();
  }

  void start(const Item* initial, std::size_t count) {
    // Relaxed throughout: the start of the job publishes it.
    if (HostAtomics::load(counters_.cancelled.cell, HostAtomics::relaxed) != 0) reset();
    view_.initial = initial;
    view_.initial_count = count;
    const auto portions = static_cast<std::uint32_t>((count + BatchSize - 1) / BatchSize);
    HostAtomics::store(counters_.live.cell, portions, HostAtomics::relaxed);
    HostAtomics::store(counters_.claimed.cell, std::uint64_t{0}, HostAtomics::relaxed);
    for (Member& m : members_) m.counts = {};
  }

  void arrive(int worker) {
    member(worker).protocol.arrive(view_, static_cast<std::uint32_t>(worker));
  }

  /// Fills the empty stack, waiting if needed. False: the run is over or cancelled.
  bool take(int worker, WorkStack<Item>& stack) {
    Member& m = member(worker);
    auto taken = m.protocol.own_batch();
    if (taken.count == 0) {
      SpinWait waiting(m.counts.ms_waited);
      while (!m.protocol.steal_from_all()) {
        if (m.protocol.over() || m.protocol.cancelled()) return false;
        waiting.pause();
      }
      taken = m.protocol.own_batch();
    }
    stack.push(taken.items, taken.count);
    m.protocol.release(taken);
    return true;
  }

  bool should_share(int, const WorkStack<Item>& stack) const { return stack.size() > stack_size_; }

  /// Offers a batch of the oldest items. False: the run is cancelled.
  bool share(int worker, WorkStack<Item>& stack) {
    Member& m = member(worker);
    if (m.protocol.cancelled()) return false;
    const std::size_t count = std::min<std::size_t>(stack.size(), batch_size_);
    if (Chunk<Item, BatchSize>* batch = m.protocol.new_batch()) {
      stack.take_oldest(batch->items, count);
      batch->count = static_cast<std::uint32_t>(count);
      m.protocol.publish();
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
    const std::size_t batches = std::size_t{view_.workers} * view_.batches;
    return sizeof(*this) + view_.workers * (sizeof(Member) + sizeof(deque_words_[0])) +
           batches * (2 * sizeof(Slot) + sizeof(Chunk<Item, BatchSize>)) +
           std::size_t{view_.workers} * view_.workers * sizeof(std::uint32_t);
  }

 private:
  using View = GreedyStealingView<HostAtomics, Item, BatchSize>;
  using Slot = HostAtomics::Cell<std::uint32_t>;
  struct alignas(HostAtomics::spacing) Member {
    GreedyStealingWorker<HostAtomics, Item, BatchSize> protocol;
    WorkerCounts counts;
  };

  Member& member(int worker) { return members_[static_cast<std::size_t>(worker)]; }
  const Member& member(int worker) const { return members_[static_cast<std::size_t>(worker)]; }

  void reset() {
    const auto zero = [](auto& cell) { HostAtomics::store(cell, {}, HostAtomics::relaxed); };
    zero(counters_.cancelled.cell);
    for (std::uint32_t i = 0; i < view_.workers; ++i) zero(deque_words_[i].cell);
    for (std::uint32_t i = 0; i < view_.workers * view_.batches; ++i) {
      zero(rings_[i]);
      zero(in_use_[i]);
    }
  }

  std::size_t stack_size_;
  std::uint32_t batch_size_;
  typename View::Counters counters_;
  std::unique_ptr<typename View::template Spaced<std::uint64_t>[]> deque_words_;
  std::unique_ptr<Slot[]> rings_;
  std::unique_ptr<Slot[]> in_use_;
  std::unique_ptr<Chunk<Item, BatchSize>[]> chunks_;
  std::unique_ptr<std::uint32_t[]> won_;
  View view_;
  std::vector<Member> members_;
};

}  // namespace lazyccd::research
