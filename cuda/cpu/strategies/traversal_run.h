// The balanced run of a traversal, with the strategy that the options choose.
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <variant>

#include "core/bvh/node_pair.h"
#include "cpu/strategies/balanced_run.h"
#include "cpu/strategies/greedy_stealing.h"
#include "cpu/strategies/guided.h"
#include "cpu/strategies/lazy_stealing.h"
#include "cpu/strategies/static_list.h"
#include "cpu/strategies/task_stealing.h"
#include "host/threads/thread_pool.h"
#include "lazyccd/detector.h"

namespace lazyccd {

class TraversalRun {
 public:
  /// Strategy::thread_per_query has no run, because it makes no further items.
  TraversalRun(ThreadPool& pool, Strategy strategy, const Tuning& tuning) {
    const auto size = [](int n) { return static_cast<std::uint32_t>(n); };
    switch (strategy) {
      case Strategy::lazy_stealing:
        run_.emplace<Lazy>(pool, 0u, 0u, size(tuning.chunk));
        break;
      case Strategy::lazy_stealing_greedy:
        run_.emplace<Greedy>(pool, size(tuning.stack), size(tuning.chunk));
        break;
      case Strategy::static_list:
        run_.emplace<Static>(pool, size(tuning.idle_threshold));
        break;
      case Strategy::task_stealing:
        run_.emplace<Tasks>(pool);
        break;
      case Strategy::guided:
        run_.emplace<FromOneList>(pool);
        break;
      case Strategy::thread_per_query:
        break;
    }
  }

  /// See BalancedRun::run().
  template <class Process>
  RunCounts run(const NodePair* initial, std::size_t count, Process&& process) {
    return std::visit(
        [&](auto& run) -> RunCounts {
          if constexpr (std::is_same_v<decltype(run), std::monostate&>) {
            return {};
          } else {
            return run.run(initial, count, process);
          }
        },
        run_);
  }

  std::size_t bytes() const {
    return std::visit(
        [](const auto& run) -> std::size_t {
          if constexpr (std::is_same_v<decltype(run), const std::monostate&>) {
            return 0;
          } else {
            return run.bytes();
          }
        },
        run_);
  }

 private:
  template <class S>
  using Run = BalancedRun<NodePair, S>;
  using Lazy = Run<LazyStealing<NodePair>>;
  using Greedy = Run<GreedyStealing<NodePair>>;
  using Static = Run<StaticList<NodePair>>;
  using Tasks = Run<TaskStealing<NodePair>>;
  using FromOneList = Run<Guided<NodePair>>;

  std::variant<std::monostate, Lazy, Greedy, Static, Tasks, FromOneList> run_;
};

}  // namespace lazyccd
