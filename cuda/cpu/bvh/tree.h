// Linear bounding volume hierarchy (Lauterbach et al. 2009): leaves in Morton order, split where the
// codes first differ.
#pragma once

#include <vector>

#include "core/group.h"
#include "core/tree.h"

namespace lazyccd {

class Tree {
 public:
  void build(const std::vector<MotionBox>& leaves);
  void refit(const std::vector<MotionBox>& leaves);

  const std::vector<TreeNode>& nodes() const { return nodes_; }
  // The leaves in Morton order, as groups; and the part of that order below each node.
  const std::vector<std::int32_t>& order() const { return order_; }
  struct Range {
    std::int32_t first, last;
  };
  const std::vector<Range>& ranges() const { return ranges_; }
  // Sum of the half surface areas of all nodes over that of the root: the cost of a query that does
  // not know where it goes (Goldsmith and Salmon 1987). Grows as the tree ages.
  double cost() const { return cost_; }

 private:
  std::vector<TreeNode> nodes_;
  std::vector<std::int32_t> order_;
  std::vector<Range> ranges_;
  double cost_ = 0;
};

}  // namespace lazyccd
