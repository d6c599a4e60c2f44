// The traversal by one of the strategies of BalancedRun.
#pragma once

#include <cstddef>

#include "core/bvh/node_pair.h"
#include "cpu/pair_visitor.h"
#include "cpu/strategies/balanced_run.h"
#include "cpu/strategies/traversal_run.h"

namespace lazyccd {

/// The visitor is part of the loop over the pairs: only run() is a virtual call.
template <class Strategy>
class BalancedTraversal : public TraversalRun {
 public:
  /// The `options` are passed to the strategy after the number of workers.
  template <class... Options>
  explicit BalancedTraversal(ThreadPool& pool, Options... options) : run_(pool, options...) {}

  bool needs_everyone() const override { return Strategy::everyone; }
  RunCounts run(Span<const NodePair> initial, const PairVisitor& visitor) override {
    return run_.run(initial.data(), initial.size(), visitor);
  }
  std::size_t bytes() const override { return run_.bytes(); }

 private:
  BalancedRun<NodePair, Strategy> run_;
};

}  // namespace lazyccd
