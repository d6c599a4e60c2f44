// The bounded deque of task stealing (Arora, Blumofe and Plaxton 1998; da Silva, Algorithms 3.5 and
// 3.6). Its owner pushes and pops at the bottom without a lock; thieves take single tasks at the
// top.
//
// Whenever the deque becomes empty, its array is used from the start again. The `tag` beside the
// top counts these fillings and tells one from the next.
//
// Model: tests/model/task_deque.pml.
#pragma once

#include <cstdint>

#include "core/platform.h"

namespace lazyccd::research {

/// The top of a task deque, and how often the deque was emptied (tag).
struct TaskAge {
  std::uint32_t top, tag;

  LAZYCCD_HD static TaskAge unpack(std::uint64_t bits) {
    return {static_cast<std::uint32_t>(bits), static_cast<std::uint32_t>(bits >> 32)};
  }
  LAZYCCD_HD std::uint64_t pack() const { return std::uint64_t{tag} << 32 | top; }
};

/// A view; zeroed memory is an empty deque. A task is one word, read and written as a whole.
template <class Atomics>
class TaskDeque {
 public:
  using Word = typename Atomics::template Cell<std::uint64_t>;
  using Index = typename Atomics::template Cell<std::uint32_t>;

  LAZYCCD_HD TaskDeque(Word& age, Index& bottom, Word* tasks, std::uint32_t capacity)
      : age_(&age), bottom_(&bottom), tasks_(tasks), capacity_(capacity) {}

  /// Whether there seems to be something to steal; an estimate.
  LAZYCCD_HD bool promising() const {
    return TaskAge::unpack(Atomics::load(*age_, Atomics::relaxed)).top <
           Atomics::load(*bottom_, Atomics::relaxed);
  }

  /// Owner only. Free slots behind the newest task, up to the end of the array. The array is used
  /// from its start again once the deque is empty.
  LAZYCCD_HD std::uint32_t room() const {
    return capacity_ - Atomics::load(*bottom_, Atomics::relaxed);  // only the owner writes it
  }
  /// Owner only. The first free slot.
  LAZYCCD_HD Word* next() const { return tasks_ + Atomics::load(*bottom_, Atomics::relaxed); }
  /// Owner only. Publishes `count` tasks that the owner has written at next(); at most room().
  LAZYCCD_HD void push(std::uint32_t count) {
    const std::uint32_t bottom = Atomics::load(*bottom_, Atomics::relaxed);
    // Release: pairs with the load of bottom in steal(). Publishes the tasks and what they refer
    // to.
    Atomics::store(*bottom_, bottom + count, Atomics::release);
  }

  /// Owner only. Pops the newest tasks, up to `max_count`; returns how many. They are at `first`
  /// and stay there until the next push(). Thieves take the oldest task, one at a time, so the
  /// owner can pop several at the price of one.
  LAZYCCD_HD std::uint32_t pop(std::uint32_t max_count, Word*& first) {
    const std::uint32_t end =
        Atomics::load(*bottom_, Atomics::relaxed);  // only the owner writes it
    if (end == 0) return 0;
    const std::uint32_t bottom = end > max_count ? end - max_count : 0;
    // seq_cst for this store and the load after it, and in steal() for the loads of age and then of
    // bottom. So either the thief sees that the tasks are gone, or the owner sees what was stolen.
    // At most one thief has loaded both before this store and takes one more task, the oldest.
    Atomics::store(*bottom_, bottom, Atomics::seq_cst);
    std::uint64_t seen = Atomics::load(*age_, Atomics::seq_cst);
    const TaskAge age = TaskAge::unpack(seen);
    first = tasks_ + bottom;
    if (bottom > age.top) return end - bottom;
    // The owner takes all that is left, or nothing. The array is used from its start again, under a
    // new tag. A thief with the old age finds nothing if it sees the bottom of zero. If it sees a
    // bottom of the next filling, its exchange fails.
    Atomics::store(*bottom_, 0u, Atomics::seq_cst);
    const std::uint64_t emptied = TaskAge{0, age.tag + 1}.pack();
    // seq_cst: decides between the owner and a thief that takes the same task.
    if (end <= age.top ||
        !Atomics::compare_exchange(*age_, seen, emptied, Atomics::seq_cst, Atomics::relaxed))
      Atomics::store(*age_, emptied, Atomics::seq_cst);  // bottom is 0: no thief changes it now
    const std::uint32_t top = TaskAge::unpack(seen).top;
    first = tasks_ + top;
    return end > top ? end - top : 0;
  }

  /// Any thread. Takes the oldest task; false if the deque is empty or another thread was faster.
  LAZYCCD_HD bool steal(std::uint64_t& task) {
    // seq_cst, in this order: see pop().
    std::uint64_t seen = Atomics::load(*age_, Atomics::seq_cst);
    const std::uint32_t bottom = Atomics::load(*bottom_, Atomics::seq_cst);
    TaskAge age = TaskAge::unpack(seen);
    if (bottom <= age.top) return false;
    // Relaxed: ordered by the load of bottom. The task may be outdated; then the CAS fails.
    task = Atomics::load(tasks_[age.top], Atomics::relaxed);
    ++age.top;
    return Atomics::compare_exchange(*age_, seen, age.pack(), Atomics::seq_cst, Atomics::relaxed);
  }

 private:
  Word* age_;
  Index* bottom_;
  Word* tasks_;
  std::uint32_t capacity_;
};

}  // namespace lazyccd::research
