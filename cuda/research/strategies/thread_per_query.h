// The baseline: each group is a query of its own from the root, without balancing.
#pragma once

#include <cstddef>

#include "cpu/strategies/traversal_run.h"
#include "host/threads/thread_pool.h"

namespace lazyccd::research {

/// It has no front: the pool's threads share the groups, whatever the initial pairs are.
class ThreadPerQuery : public TraversalRun {
 public:
  explicit ThreadPerQuery(ThreadPool& pool) : pool_(pool) {}

  bool has_front() const override { return false; }
  bool needs_everyone() const override { return false; }
  RunCounts run(Span<const NodePair> initial, const PairVisitor& visitor) override;
  std::size_t bytes() const override { return 0; }

 private:
  ThreadPool& pool_;
};

}  // namespace lazyccd::research
