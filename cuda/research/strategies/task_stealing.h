// Task stealing between CPU threads: owns the memory that research/protocols/task_deque.h works on.
// Every item goes through its worker's deque, and thieves take items one by one. One of the
// strategies of BalancedRun, which says what a strategy is.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <type_traits>
#include <vector>

#include "balance/host_atomics.h"
#include "balance/portions.h"
#include "balance/termination.h"
#include "cpu/strategies/work_stack.h"
#include "cpu/strategies/worker_counts.h"
#include "host/threads/spin_wait.h"
#include "research/protocols/task_deque.h"

namespace lazyccd::research {

template <class ItemType>
class TaskStealing {
  static_assert(sizeof(ItemType) == sizeof(std::uint64_t), "a task is one word");

 public:
  using Item = ItemType;
  static constexpr bool everyone = false;

  /// capacity: tasks per deque; items that find no room stay with their worker. 0: as many as a
  /// depth-first traversal ever has.
  explicit TaskStealing(int workers, std::uint32_t capacity = 0)
      : capacity_(capacity != 0 ? capacity : 8192), members_(static_cast<std::size_t>(workers)) {
    for (Member& m : members_) m.tasks.reset(new Word[capacity_]);
    reset();
  }

  void start(const Item* initial, std::size_t count) {
    // Relaxed throughout: the start of the job publishes it.
    if (HostAtomics::load(cancelled_.value, HostAtomics::relaxed) != 0) reset();
    initial_ = initial;
    count_ = count;
    const auto portions = static_cast<std::uint32_t>((count + portion_size - 1) / portion_size);
    HostAtomics::store(live_.value, portions, HostAtomics::relaxed);
    HostAtomics::store(claimed_.value, std::uint64_t{0}, HostAtomics::relaxed);
    for (Member& m : members_) m.counts = {};
  }

  void arrive(int worker) {
    Member& m = member(worker);
    m.busy = false;
    m.claims.start(count_);
    m.victim = static_cast<std::uint32_t>(worker);
  }
  void leave(int) {}

  /// Fills the empty stack, waiting if needed. False: the run is over or cancelled.
  bool take(int worker, WorkStack<Item>& stack) {
    Member& m = member(worker);
    Word* newest = nullptr;
    if (deque(m).pop(1, newest) != 0) {
      // Relaxed: the owner's own store.
      stack.push(item_of(HostAtomics::load(*newest, HostAtomics::relaxed)));
      return true;
    }
    const Portion portion = m.claims.template next<HostAtomics>(claimed_.value, portion_size);
    if (portion.count != 0) {
      // An idle worker takes over the portion's unit of `live`. For a busy worker that unit ends.
      if (m.busy) termination().unit_ended();
      m.busy = true;
      stack.push(initial_ + portion.first, portion.count);
      return true;
    }
    if (m.busy) termination().unit_ended();
    m.busy = false;
    SpinWait waiting(m.counts.ms_waited);
    for (;;) {
      if (termination().over() || cancelled()) return false;
      std::uint64_t task;
      if (steal(m, task)) {
        stack.push(item_of(task));
        return true;
      }
      waiting.pause();
    }
  }

  bool should_share(int, const WorkStack<Item>& stack) const { return !stack.empty(); }

  /// Moves all new tasks to the own deque. False: the run is cancelled.
  bool share(int worker, WorkStack<Item>& stack) {
    Member& m = member(worker);
    auto own = deque(m);
    const auto count = static_cast<std::uint32_t>(std::min<std::size_t>(stack.size(), own.room()));
    if (count < stack.size()) ++m.counts.overflows;
    Word* const next = own.next();
    for (std::uint32_t i = 0; i < count; ++i)
      HostAtomics::store(next[i], task_of(stack.pop()), HostAtomics::relaxed);  // see push()
    own.push(count);
    return !cancelled();
  }

  void cancel(int) { HostAtomics::store(cancelled_.value, 1u, HostAtomics::relaxed); }

  WorkerCounts counts(int worker) const { return member(worker).counts; }
  std::size_t bytes() const {
    return sizeof(*this) + members_.size() * (sizeof(Member) + capacity_ * sizeof(Word));
  }

 private:
  static constexpr std::uint32_t portion_size = 64;
  using Word = HostAtomics::Cell<std::uint64_t>;
  template <class T>
  struct alignas(HostAtomics::spacing) Cell {
    HostAtomics::Cell<T> value{0};
  };
  struct alignas(HostAtomics::spacing) Member {
    Word age{0};
    HostAtomics::Cell<std::uint32_t> bottom{0};
    std::unique_ptr<Word[]> tasks;
    bool busy = false;  // counted in `live` (Termination)
    Claims claims;
    std::uint32_t victim = 0;
    WorkerCounts counts;
  };

  static std::uint64_t task_of(const Item& item) {
    std::uint64_t task;
    std::memcpy(&task, &item, sizeof task);
    return task;
  }
  static Item item_of(std::uint64_t task) {
    Item item;
    std::memcpy(&item, &task, sizeof item);
    return item;
  }

  Member& member(int worker) { return members_[static_cast<std::size_t>(worker)]; }
  const Member& member(int worker) const { return members_[static_cast<std::size_t>(worker)]; }
  TaskDeque<HostAtomics> deque(Member& m) { return {m.age, m.bottom, m.tasks.get(), capacity_}; }
  Termination<HostAtomics> termination() { return Termination<HostAtomics>(live_.value); }
  bool cancelled() const { return HostAtomics::load(cancelled_.value, HostAtomics::relaxed) != 0; }

  /// Tries once to steal from one victim. The thief counts itself as busy before it takes anything.
  /// Otherwise the victim could become idle at once, `live` would be zero, and the other workers
  /// would leave the thief alone with the work that comes from the task.
  bool steal(Member& m, std::uint64_t& task) {
    Member& victim = members_[m.victim];
    if (deque(victim).promising()) {
      termination().chunk_published();
      if (deque(victim).steal(task)) {
        m.busy = true;
        ++m.counts.steals;
        return true;
      }
      termination().unit_ended();
    }
    m.victim = m.victim + 1 < members_.size() ? m.victim + 1 : 0;
    return false;
  }

  void reset() {
    HostAtomics::store(cancelled_.value, 0u, HostAtomics::relaxed);
    for (Member& m : members_) {
      HostAtomics::store(m.age, std::uint64_t{0}, HostAtomics::relaxed);
      HostAtomics::store(m.bottom, 0u, HostAtomics::relaxed);
    }
  }

  std::uint32_t capacity_;
  std::vector<Member> members_;
  const Item* initial_ = nullptr;
  std::size_t count_ = 0;
  Cell<std::uint32_t> live_, cancelled_;
  Cell<std::uint64_t> claimed_;
};

}  // namespace lazyccd::research
