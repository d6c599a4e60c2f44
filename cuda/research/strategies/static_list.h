// Static lists between CPU threads: owns the memory that research/protocols/static_list.h works on,
// and makes the threads meet for the balancing step. One of the strategies of BalancedRun, which
// says what a strategy is.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "balance/host_atomics.h"
#include "cpu/strategies/work_stack.h"
#include "cpu/strategies/worker_counts.h"
#include "host/threads/spin_wait.h"
#include "research/protocols/static_list.h"

namespace lazyccd::research {

template <class ItemType>
class StaticList {
 public:
  using Item = ItemType;
  static constexpr bool everyone = true;  // a round ends only when every worker has arrived

  /// idle_threshold: number of workers with an empty list that ends a round; 0: half of all
  /// workers, as in gProximity. capacity: items of a list; a longer list ends the round too; 0: no
  /// limit.
  explicit StaticList(int workers, std::uint32_t idle_threshold = 0, std::uint32_t capacity = 0)
      : members_(static_cast<std::size_t>(workers)),
        lists_(members_.size()),
        threshold_(idle_threshold != 0 ? idle_threshold
                                       : std::max(static_cast<std::uint32_t>(workers) / 2, 1u)),
        capacity_(capacity != 0 ? capacity : std::numeric_limits<std::uint32_t>::max()) {}

  void start(const Item* initial, std::size_t count) {
    // Relaxed throughout: the start of the job publishes it.
    for (auto* cell : {&idle_, &stop_, &arrived_, &round_, &ended_})
      HostAtomics::store(cell->value, 0u, HostAtomics::relaxed);
    for (Member& member : members_) member.reset();
    std::fill(lists_.begin(), lists_.end(), ItemList<Item>{nullptr, 0});
    lists_[0] = {initial, count};
    rounds_ = 0;
  }

  void arrive(int) {}

  /// Fills the empty stack, waiting if needed. False: the run is over or cancelled.
  bool take(int worker, WorkStack<Item>& stack) {
    Member& m = member(worker);
    for (;;) {
      if (!m.first_round) {
        round_end().ran_dry();
        if (!next_round(worker)) return false;
      }
      m.first_round = false;
      m.steps = 0;
      take_even_part(lists_.data(), static_cast<std::uint32_t>(lists_.size()),
                     static_cast<std::uint32_t>(worker), workers(),
                     [&](const Item* items, std::uint64_t count) { stack.push(items, count); });
      if (!stack.empty()) return true;
    }
  }

  /// Whether the list is too long or the round has been stopped. Each worker processes at least
  /// min_steps items in a round; otherwise there would be a balancing step for every few items.
  bool should_share(int worker, const WorkStack<Item>& stack) {
    if (stack.size() > capacity_) return true;
    return ++member(worker).steps >= min_steps && round_end().stopped();
  }

  /// Ends the round for this worker: leaves its items to the balancing step. False: the run is
  /// cancelled.
  bool share(int worker, WorkStack<Item>& stack) {
    Member& m = member(worker);
    if (stack.size() > capacity_) ++m.counts.overflows;
    round_end().stop();
    std::vector<Item>& list = m.left[m.round % 2];
    list.resize(stack.size());
    stack.take_all(list.data());
    return !cancelled();
  }

  void cancel(int) {
    HostAtomics::store(ended_.value, cancelled_run, HostAtomics::relaxed);
    round_end().stop();
  }
  void leave(int) {}

  WorkerCounts counts(int worker) const {
    WorkerCounts counts = member(worker).counts;
    if (worker == 0) counts.rounds = rounds_;
    return counts;
  }
  std::size_t bytes() const {
    std::size_t sum = sizeof(*this) + lists_.capacity() * sizeof(ItemList<Item>);
    for (const Member& m : members_)
      sum += sizeof(m) + (m.left[0].capacity() + m.left[1].capacity()) * sizeof(Item);
    return sum;
  }

 private:
  static constexpr std::uint32_t min_steps = 32;
  static constexpr std::uint32_t finished_run = 1, cancelled_run = 2;

  struct alignas(HostAtomics::spacing) Cell {
    HostAtomics::Cell<std::uint32_t> value{0};
  };
  struct alignas(HostAtomics::spacing) Member {
    // What the worker left at the end of a round. There are two, used in turn: the worker writes
    // one while others still read that of the last round.
    std::vector<Item> left[2];
    std::uint32_t round = 0;
    std::uint32_t steps = 0;  // in this round
    bool first_round = true;
    WorkerCounts counts;

    void reset() {
      left[0].clear();
      left[1].clear();
      round = steps = 0;
      first_round = true;
      counts = {};
    }
  };

  Member& member(int worker) { return members_[static_cast<std::size_t>(worker)]; }
  const Member& member(int worker) const { return members_[static_cast<std::size_t>(worker)]; }
  std::uint32_t workers() const { return static_cast<std::uint32_t>(members_.size()); }
  RoundEnd<HostAtomics> round_end() { return {idle_.value, stop_.value, threshold_}; }
  bool cancelled() const {
    return HostAtomics::load(ended_.value, HostAtomics::relaxed) == cancelled_run;
  }

  /// Waits for all workers; the last one to arrive lays out the lists. False: nothing is left, or
  /// the run is cancelled.
  bool next_round(int worker) {
    Member& m = member(worker);
    const std::uint32_t round = m.round++;
    // Release: publishes what this worker left. Acquire: makes visible what the others left.
    if (HostAtomics::fetch_add(arrived_.value, 1u, HostAtomics::acq_rel) + 1 == workers()) {
      begin_round(round);
    } else {
      SpinWait waiting(m.counts.ms_waited);
      // Acquire: pairs with the release in begin_round().
      while (HostAtomics::load(round_.value, HostAtomics::acquire) == round) {
        if (cancelled()) return false;
        waiting.pause();
      }
    }
    return HostAtomics::load(ended_.value, HostAtomics::relaxed) == 0;
  }

  void begin_round(std::uint32_t round) {
    bool empty = true;
    for (std::size_t i = 0; i < lists_.size(); ++i) {
      std::vector<Item>& left = members_[i].left[round % 2];
      lists_[i] = {left.data(), left.size()};
      empty = empty && left.empty();
      members_[i].left[1 - round % 2].clear();
    }
    ++rounds_;
    // Relaxed: published by the release of round_ below.
    if (empty && !cancelled()) HostAtomics::store(ended_.value, finished_run, HostAtomics::relaxed);
    for (auto* cell : {&idle_, &stop_, &arrived_})
      HostAtomics::store(cell->value, 0u, HostAtomics::relaxed);
    HostAtomics::store(round_.value, round + 1, HostAtomics::release);
  }

  std::vector<Member> members_;
  std::vector<ItemList<Item>> lists_;  // lists of the current round
  std::uint32_t threshold_;
  std::uint32_t capacity_;
  std::uint64_t rounds_ = 0;
  Cell idle_, stop_, arrived_, round_, ended_;
};

}  // namespace lazyccd::research
