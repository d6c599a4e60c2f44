// Runs work items that make further work items, such as the node pairs of a tree traversal, on all
// threads of a pool.
//
//   BalancedRun<NodePair> traversal(pool);                   // once: buffers persist between runs
//   RunCounts counts = traversal.run(&root_pair, 1,
//       [&](int worker, NodePair pair, auto& emit) { ... emit(child_pair); ... });
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/bvh/node_pair.h"
#include "cpu/strategies/lazy_stealing.h"
#include "cpu/strategies/work_stack.h"
#include "cpu/strategies/worker_counts.h"
#include "host/threads/thread_pool.h"
#include "lazyccd/debug/assert.h"

namespace lazyccd {

/// Statistics of a run, summed over the workers.
struct RunCounts : WorkerCounts {
  std::uint64_t items = 0;  // items processed
  double ms_present = 0;    // time between arrival and departure of the workers, milliseconds
};

/// Runs items on the workers of a pool.
///
/// A Strategy moves items between the workers. Beside it, each worker has a WorkStack with its own
/// items. A Strategy provides:
///
///   Item, Strategy(workers, ...)
///   everyone                whether every worker must take part; if not, some may never arrive
///   start(initial, count)   called by one thread, before the workers
///   arrive(w), leave(w)     called at the start and at the end of a worker's part
///   take(w, stack)          fills the empty stack, waiting if needed; false: nothing is left
///   should_share(w, stack)  called after every item, so it may cost only a load or two
///   share(w, stack)         gives away some or all items of the stack; false: cancelled
///   cancel(w)               worker w failed; the others leave soon, and the next start() recovers
///   counts(w), bytes()      statistics of the last run; memory in use
template <class Item, class Strategy = LazyStealing<Item>>
class BalancedRun {
 public:
  /// The `options` are passed to the strategy after the number of workers. The pool must outlive
  /// this object.
  template <class... DetectorOptions>
  explicit BalancedRun(ThreadPool& pool, DetectorOptions... options)
      : pool_(&pool),
        strategy_(pool.size(), options...),
        members_(static_cast<std::size_t>(pool.size())) {}

  /// Calls process(worker, item, emit) exactly once for each initial item and for each item passed
  /// to emit(item), in no particular order. The worker ids are below pool.size(). There is only one
  /// call at a time per worker id, so scratch memory indexed by it needs no lock. An exception from
  /// process ends the run and is rethrown here; the next run starts afresh.
  template <class Process>
  RunCounts run(const Item* initial, std::size_t count, Process&& process) {
    if (count == 0) return {};
    strategy_.start(initial, count);
    for (Member& member : members_) member.items = 0, member.ms_present = 0;
    const auto job = [&](int worker) { work(worker, process); };
    if constexpr (Strategy::everyone) {
      pool_->run(job);
    } else {
      pool_->run_optional(job);
    }
    RunCounts counts;
    LAZYCCD_ASSERT(have_empty_stacks(), "no item is left when a run ends");
    for (int worker = 0; worker < pool_->size(); ++worker) {
      counts += strategy_.counts(worker);
      counts.items += members_[static_cast<std::size_t>(worker)].items;
      counts.ms_present += members_[static_cast<std::size_t>(worker)].ms_present;
    }
    return counts;
  }

  std::size_t bytes() const {
    std::size_t sum = sizeof(*this) + strategy_.bytes();
    for (const Member& member : members_) sum += sizeof(member) + member.stack.bytes();
    return sum;
  }

 private:
  bool have_empty_stacks() const {
    return std::all_of(members_.begin(), members_.end(),
                       [](const Member& member) { return member.stack.empty(); });
  }

  struct alignas(128) Member {  // two cache lines: the neighbours belong to other workers
    WorkStack<Item> stack;
    std::uint64_t items = 0;
    double ms_present = 0;
  };

  template <class Process>
  void work(int worker, Process& process) {
    Member& member = members_[static_cast<std::size_t>(worker)];
    WorkStack<Item>& stack = member.stack;
    std::uint64_t items = 0;
    const auto emit = [&stack](const Item& item) { stack.push(item); };
    const auto arrival = std::chrono::steady_clock::now();
    strategy_.arrive(worker);
    try {
      while (strategy_.take(worker, stack)) {
        do {
          process(worker, stack.pop(), emit);
          ++items;
          if (strategy_.should_share(worker, stack) && !strategy_.share(worker, stack))
            stack.clear();
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
    member.ms_present =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - arrival)
            .count();
  }

  ThreadPool* pool_;
  Strategy strategy_;
  std::vector<Member> members_;
};

}  // namespace lazyccd
