// Linear bounding volume hierarchy (Lauterbach et al. 2009): the leaves are sorted in Morton order,
// and nodes are split at the highest bit in which the codes differ.
#pragma once

#include <vector>

#include "core/bvh/group.h"
#include "core/bvh/tree.h"

namespace lazyccd {

/// The binary tree over the groups.
class Tree {
 public:
  /// Builds a new tree over the boxes of the groups.
  void build(const std::vector<MotionBox>& leaves);
  /// Computes the boxes of all nodes for new boxes of the same groups.
  void refit(const std::vector<MotionBox>& leaves);

  const std::vector<TreeNode>& nodes() const { return nodes_; }
  /// Group indices of the leaves, in Morton order.
  const std::vector<std::int32_t>& order() const { return order_; }
  /// The part [first, last) of order() that is below a node.
  struct Range {
    std::int32_t first, last;
  };
  const std::vector<Range>& ranges() const { return ranges_; }  ///< by node
  /// Sum of the surface areas of all nodes divided by that of the root: the expected cost of a
  /// query at a random place (Goldsmith and Salmon 1987). It grows while the tree is refitted.
  double cost() const { return cost_; }

 private:
  std::vector<TreeNode> nodes_;
  std::vector<std::int32_t> order_;
  std::vector<Range> ranges_;
  double cost_ = 0;
};

}  // namespace lazyccd
