#include "research/strategies/thread_per_query.h"

#include <cstdint>
#include <vector>

#include "core/bvh/tree.h"
#include "cpu/pair_visitor.h"
#include "lazyccd/debug/stopwatch.h"

namespace lazyccd::research {
namespace {

// Finds all groups that overlap the leaf `self`. Returns the number of tested nodes.
std::uint64_t query(const PairVisitor& visitor, int id, std::uint32_t self,
                    std::vector<std::uint32_t>& stack) {
  const NoinitVector<TreeNode>& nodes = visitor.nodes();
  const TreeNode& q = nodes[self];
  visitor.visit_leaves(id, {self, self});
  std::uint64_t tested = 0;
  stack.push_back(0);
  while (!stack.empty()) {
    const std::uint32_t other = stack.back();
    stack.pop_back();
    const TreeNode& n = nodes[other];
    ++tested;
    if (!overlap(q, n) || visitor.is_culled(id, {self, other})) continue;
    if (!n.leaf()) {
      const ChildrenToVisit children =
          children_to_visit(nodes.data(), n, static_cast<std::int32_t>(self));
      for (int i = children.count; i-- > 0;)
        stack.push_back(static_cast<std::uint32_t>(children.node[i]));
    } else if (q.group() < n.group()) {
      visitor.visit_leaves(id, {self, other});
    }
  }
  return tested;
}

}  // namespace

RunCounts ThreadPerQuery::run(Span<const NodePair>, const PairVisitor& visitor) {
  struct alignas(128) Share {  // two cache lines: the neighbours belong to other threads
    std::uint64_t tested = 0;
    double ms = 0;
  };
  std::vector<Share> shares(static_cast<std::size_t>(pool_.size()));
  const NoinitVector<TreeNode>& nodes = visitor.nodes();
  pool_.parallel_for(nodes.size(), 64, [&](std::size_t first, std::size_t last, int id) {
    Stopwatch busy;
    std::vector<std::uint32_t> stack;
    Share& share = shares[static_cast<std::size_t>(id)];
    for (std::size_t node = first; node < last; ++node)
      if (nodes[node].leaf())
        share.tested += query(visitor, id, static_cast<std::uint32_t>(node), stack);
    share.ms += busy.lap();
  });
  RunCounts counts;
  for (const Share& share : shares) {
    counts.items += share.tested;
    counts.ms_present += share.ms;
  }
  return counts;
}

}  // namespace lazyccd::research
