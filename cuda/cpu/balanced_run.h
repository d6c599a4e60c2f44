// Runs work items that make further work items, such as the pairs of a tree traversal, on all
// threads of a pool.
//
//   BalancedRun<NodePair> traversal(pool);                   // once: buffers persist between runs
//   RunCounts counts = traversal.run(&root_pair, 1,
//       [&](int worker, NodePair pair, auto& emit) { ... emit(child_pair); ... });
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/node_pair.h"
#include "cpu/lazy_stealing.h"
#include "cpu/thread_pool.h"
#include "cpu/work_stack.h"

namespace lazyccd {

struct RunCounts {
  std::uint64_t items = 0;      // processed
  std::uint64_t steals = 0;     // batches taken from another worker
  std::uint64_t overflows = 0;  // times that items stayed with their worker for want of room
};

// A Strategy moves items between workers; each worker's own items are a WorkStack beside it:
//
//   Item, Strategy(workers, ...)
//   start(initial, count)   one thread, before the workers
//   arrive(w), leave(w)     around a worker's part; some workers may never arrive
//   take(w, stack)          fills the empty stack, waiting for others' work; false: nothing left
//   hungry(w)               after every item, so a load or two: is it time to share?
//   share(w, stack)         gives some of the stack away; false: cancelled
//   cancel(w)               the worker failed; the others leave soon, and the next start() recovers
//   steals(), overflows(), bytes()
template <class Item, class Strategy = LazyStealing<Item>>
class BalancedRun {
 public:
  // `options` go to the strategy, after the number of workers. The pool must outlive this.
  template <class... Options>
  explicit BalancedRun(ThreadPool& pool, Options... options)
      : pool_(&pool),
        strategy_(pool.size(), options...),
        members_(static_cast<std::size_t>(pool.size())) {}

  // process(worker, item, emit) exactly once for each of the initial items and of those given to
  // emit(item), in no particular order, on worker ids below pool.size(). One call at a time a
  // worker id, so scratch memory indexed by it needs no lock. An exception from process ends the
  // run and is rethrown here; the next run starts afresh.
  template <class Process>
  RunCounts run(const Item* initial, std::size_t count, Process&& process) {
    if (count == 0) return {};
    strategy_.start(initial, count);
    for (Member& member : members_) member.items = 0;
    pool_->offer([&](int worker) { work(worker, process); });
    RunCounts counts;
    for (const Member& member : members_) counts.items += member.items;
    counts.steals = strategy_.steals();
    counts.overflows = strategy_.overflows();
    return counts;
  }

  std::size_t bytes() const {
    std::size_t sum = sizeof(*this) + strategy_.bytes();
    for (const Member& member : members_) sum += sizeof(member) + member.stack.bytes();
    return sum;
  }

 private:
  struct alignas(128) Member {  // two cache lines: neighbours are other workers'
    WorkStack<Item> stack;
    std::uint64_t items = 0;
  };

  template <class Process>
  void work(int worker, Process& process) {
    Member& member = members_[static_cast<std::size_t>(worker)];
    WorkStack<Item>& stack = member.stack;
    std::uint64_t items = 0;
    const auto emit = [&stack](const Item& item) { stack.push(item); };
    strategy_.arrive(worker);
    try {
      while (strategy_.take(worker, stack)) {
        do {
          process(worker, stack.pop(), emit);
          ++items;
          if (strategy_.hungry(worker) && !strategy_.share(worker, stack)) stack.clear();
        } while (!stack.empty());
      }
    } catch (...) {
      stack.clear();
      strategy_.cancel(worker);
      strategy_.leave(worker);
      throw;
    }
    strategy_.leave(worker);
    member.items = items;
  }

  ThreadPool* pool_;
  Strategy strategy_;
  std::vector<Member> members_;
};

}  // namespace lazyccd
