// The bounded deque of task stealing: its owner pushes and pops at the bottom without a lock,
// thieves take single tasks at the top (Arora, Blumofe and Plaxton 2001; the dissertation's
// Algorithms 3.5 and 3.6). The `tag` beside the top tells one filling of the array from the next.
//
// Model: tests/model/task_deque.pml.
#pragma once

#include <cstdint>

#include "core/platform.h"

namespace lazyccd {

// Top of a task deque and the number of times that it was emptied.
struct TaskAge {
  std::uint32_t top, tag;

  LAZYCCD_HD static TaskAge unpack(std::uint64_t bits) {
    return {static_cast<std::uint32_t>(bits), static_cast<std::uint32_t>(bits >> 32)};
  }
  LAZYCCD_HD std::uint64_t pack() const { return std::uint64_t{tag} << 32 | top; }
};

// A view; zeroed memory is an empty deque. A task is one word, read and written whole.
template <class Atomics>
class TaskDeque {
 public:
  using Word = typename Atomics::template Cell<std::uint64_t>;
  using Index = typename Atomics::template Cell<std::uint32_t>;

  LAZYCCD_HD TaskDeque(Word& age, Index& bottom, Word* tasks, std::uint32_t capacity)
      : age_(&age), bottom_(&bottom), tasks_(tasks), capacity_(capacity) {}

  // A guess: whether there is something to steal.
  LAZYCCD_HD bool promising() const {
    return TaskAge::unpack(Atomics::load(*age_, Atomics::relaxed)).top <
           Atomics::load(*bottom_, Atomics::relaxed);
  }

  // Owner only. Room behind the newest task, up to the array's end, which is used anew once the
  // deque is empty. push() is for so many that the owner has written there.
  LAZYCCD_HD std::uint32_t room() const {
    return capacity_ - Atomics::load(*bottom_, Atomics::relaxed);  // only the owner writes it
  }
  LAZYCCD_HD Word* next() const { return tasks_ + Atomics::load(*bottom_, Atomics::relaxed); }
  LAZYCCD_HD void push(std::uint32_t count) {
    const std::uint32_t bottom = Atomics::load(*bottom_, Atomics::relaxed);
    // Release, pairs with the load of bottom in steal(): the tasks, and what they stand for.
    Atomics::store(*bottom_, bottom + count, Atomics::release);
  }

  // Owner only. The newest tasks, `most` at most: they lie from `first` on until the next push().
  // Thieves take the oldest one by one, so several can be popped at the price of one.
  LAZYCCD_HD std::uint32_t pop(std::uint32_t most, Word*& first) {
    const std::uint32_t end =
        Atomics::load(*bottom_, Atomics::relaxed);  // only the owner writes it
    if (end == 0) return 0;
    const std::uint32_t bottom = end > most ? end - most : 0;
    // seq_cst, this store and the load after it, and in steal() the loads of age and then of
    // bottom: either the thief sees that the tasks are gone or the owner sees what was stolen. One
    // thief at most has looked before and takes one more, the oldest.
    Atomics::store(*bottom_, bottom, Atomics::seq_cst);
    std::uint64_t seen = Atomics::load(*age_, Atomics::seq_cst);
    const TaskAge age = TaskAge::unpack(seen);
    first = tasks_ + bottom;
    if (bottom > age.top) return end - bottom;
    // All that is left, or nothing. The array is used anew from its start, under another tag. A
    // thief that meets the old top sees a bottom no larger; with the new one its exchange fails.
    Atomics::store(*bottom_, 0u, Atomics::seq_cst);
    const std::uint64_t anew = TaskAge{0, age.tag + 1}.pack();
    // seq_cst: decides between the owner and a thief who takes the same task.
    if (end <= age.top ||
        !Atomics::compare_exchange(*age_, seen, anew, Atomics::seq_cst, Atomics::relaxed))
      Atomics::store(*age_, anew, Atomics::seq_cst);  // no thief changes it any more: bottom is 0
    const std::uint32_t top = TaskAge::unpack(seen).top;
    first = tasks_ + top;
    return end > top ? end - top : 0;
  }

  // Anyone. False: empty, or another was faster.
  LAZYCCD_HD bool steal(std::uint64_t& task) {
    // seq_cst, in this order: see pop().
    std::uint64_t seen = Atomics::load(*age_, Atomics::seq_cst);
    const std::uint32_t bottom = Atomics::load(*bottom_, Atomics::seq_cst);
    TaskAge age = TaskAge::unpack(seen);
    if (bottom <= age.top) return false;
    // Relaxed: ordered by the load of bottom. It may read what no longer is, then the CAS fails.
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

}  // namespace lazyccd
