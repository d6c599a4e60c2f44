#include "research/cpu_extension.h"

#include <cstdint>

#include "cpu/balanced_traversal.h"
#include "host/extension.h"
#include "research/culling/excluded_orphans.h"
#include "research/culling/tree_culling.h"
#include "research/strategies/greedy_stealing.h"
#include "research/strategies/guided.h"
#include "research/strategies/static_list.h"
#include "research/strategies/task_stealing.h"
#include "research/strategies/thread_per_query.h"
#include "research/volumes/node_volume.h"

namespace lazyccd::research {
namespace {

std::unique_ptr<TraversalRun> make_traversal(ThreadPool& pool, Strategy strategy,
                                             const Tuning& tuning) {
  const auto size = [](int n) { return static_cast<std::uint32_t>(n); };
  switch (strategy) {
    case Strategy::lazy_stealing:
      break;  // the core has it
    case Strategy::lazy_stealing_greedy:
      return std::make_unique<BalancedTraversal<GreedyStealing<NodePair>>>(pool, size(tuning.stack),
                                                                           size(tuning.chunk));
    case Strategy::static_list:
      return std::make_unique<BalancedTraversal<StaticList<NodePair>>>(pool,
                                                                       size(tuning.idle_threshold));
    case Strategy::task_stealing:
      return std::make_unique<BalancedTraversal<TaskStealing<NodePair>>>(pool);
    case Strategy::guided:
      return std::make_unique<BalancedTraversal<Guided<NodePair>>>(pool);
    case Strategy::thread_per_query:
      return std::make_unique<ThreadPerQuery>(pool);
  }
  return nullptr;
}

std::unique_ptr<NodeCulling> make_culling(const DetectorOptions& options, double margin) {
  return std::make_unique<TreeCulling>(make_node_volume(options.algorithm.volume, margin),
                                       culling_in_use(options).normal_cones);
}

std::unique_ptr<ExcludedPairs> make_excluded_pairs() { return std::make_unique<ExcludedOrphans>(); }

constexpr CpuExtension extension{make_traversal, make_culling, make_excluded_pairs};

}  // namespace

const CpuExtension& cpu_extension() { return extension; }

}  // namespace lazyccd::research
