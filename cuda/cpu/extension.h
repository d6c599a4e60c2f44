// What an extension (host/extension.h) adds to the CPU backend.
#pragma once

#include <memory>

#include "cpu/narrow/excluded_pairs.h"
#include "cpu/node_culling.h"
#include "cpu/strategies/traversal_run.h"
#include "host/threads/thread_pool.h"
#include "lazyccd/detector.h"

namespace lazyccd {

/// Functions that make what the options ask for.
struct CpuExtension {
  /// The traversal by a strategy that the core does not have.
  std::unique_ptr<TraversalRun> (*make_traversal)(ThreadPool& pool, Strategy strategy,
                                                  const Tuning& tuning);
  /// If culls_nodes(options). Nodes are wider than their primitives by `margin` on every side.
  std::unique_ptr<NodeCulling> (*make_culling)(const DetectorOptions& options, double margin);
  /// If excludes_pairs(options).
  std::unique_ptr<ExcludedPairs> (*make_excluded_pairs)();
};

}  // namespace lazyccd
