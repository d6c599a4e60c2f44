// Interface to the run of a traversal on all threads. Each strategy has a class of its own.
#pragma once

#include <cstddef>

#include "core/bvh/node_pair.h"
#include "cpu/strategies/balanced_run.h"
#include "lazyccd/span.h"

namespace lazyccd {

class PairVisitor;  // cpu/pair_visitor.h

class TraversalRun {
 public:
  virtual ~TraversalRun() = default;
  /// Whether it can start from a front and leaves one.
  virtual bool has_front() const { return true; }
  /// Whether it ends only if every thread of the pool takes part.
  virtual bool needs_everyone() const = 0;
  /// Visits the initial pairs and all pairs that these lead to. See BalancedRun::run().
  virtual RunCounts run(Span<const NodePair> initial, const PairVisitor& visitor) = 0;
  virtual std::size_t bytes() const = 0;
};

}  // namespace lazyccd
