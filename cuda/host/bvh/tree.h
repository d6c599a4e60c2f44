// Linear bounding volume hierarchy (Lauterbach et al. 2009): the leaves are sorted in Morton order,
// and nodes are split at the highest bit in which the codes differ (core/bvh/radix_tree.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/bvh/group.h"
#include "core/bvh/radix_tree.h"
#include "core/bvh/tree.h"
#include "host/threads/key_sort.h"
#include "host/threads/noinit_vector.h"
#include "host/threads/thread_pool.h"
#include "lazyccd/span.h"

namespace lazyccd {

/// The binary tree over the groups. The children of the i-th inner node in preorder are nodes 1 +
/// 2 i and 2 + 2 i, so everything below a node lies side by side behind it.
class Tree {
 public:
  /// Builds a new tree over the codes and boxes of the groups. `worlds`: the world of each group,
  /// ascending; empty: all are in one world.
  void build(const NoinitVector<std::uint64_t>& codes, const NoinitVector<MotionBox>& leaves,
             ThreadPool& pool, Span<const std::int32_t> worlds = {});
  /// Computes the boxes of all nodes for new boxes of the same groups.
  void refit(const NoinitVector<MotionBox>& leaves, ThreadPool& pool);

  const NoinitVector<TreeNode>& nodes() const { return nodes_; }
  /// Group indices of the leaves, by world, then in Morton order.
  const NoinitVector<std::int32_t>& order() const { return order_; }
  /// The part [first, last) of order() that is below a node.
  using Range = LeafRange;
  const NoinitVector<Range>& ranges() const { return ranges_; }  ///< by node
  /// Sum of the surface areas of all nodes divided by that of the root: the expected cost of a
  /// query at a random place (Goldsmith and Salmon 1987). It grows while the tree is refitted.
  double cost() const { return cost_; }

  /// Calls f(node) for every node, after its children, on all threads.
  template <class F>
  void for_each_upward(ThreadPool& pool, F&& f) const {
    pool.parallel_for(parts_.size(), 1, [&](std::size_t first, std::size_t last, int) {
      for (std::size_t p = first; p < last; ++p) parts_[p].for_each_upward(f);
    });
    for (std::size_t i = top_.size(); i-- > 0;) f(static_cast<std::size_t>(top_[i]));
  }

  std::size_t bytes() const;

 private:
  // A subtree that one thread works on: its root and the range of all nodes below.
  struct Part {
    std::int32_t root, first_below, last_below;

    template <class F>
    void for_each_upward(F&& f) const {
      for (std::int32_t i = last_below; i-- > first_below;) f(static_cast<std::size_t>(i));
      f(static_cast<std::size_t>(root));
    }
  };

  void sort_leaves(const NoinitVector<std::uint64_t>& codes, Span<const std::int32_t> worlds,
                   ThreadPool& pool);
  // Makes the nodes below a node whose ranges_ entry is set; `first_below`: where they begin. Calls
  // opened(node) for nodes with children, a parent first. Nodes of at most `size` leaves stay
  // closed; for them it calls small(node, first_below).
  template <class Small, class Opened>
  void open(std::int32_t node, std::int32_t first_below, std::int32_t size, Small&& small,
            Opened&& opened);

  KeySort sort_;
  NoinitVector<std::uint64_t> codes_;
  Span<const std::int32_t> worlds_;  // of build(), while it runs
  NoinitVector<TreeNode> nodes_;
  NoinitVector<std::int32_t> order_;
  NoinitVector<Range> ranges_;
  std::vector<Part> parts_;
  std::vector<std::int32_t> top_;  // the nodes above the parts, a parent before its children
  std::vector<double> areas_;      // by part: sum of half the areas of its boxes
  double cost_ = 0;
};

}  // namespace lazyccd
