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
  // Sum of the half surface areas of all nodes over that of the root: the cost of a query that does
  // not know where it goes (Goldsmith and Salmon 1987). Grows as the tree ages.
  double cost() const { return cost_; }

 private:
  std::vector<TreeNode> nodes_;
  double cost_ = 0;
};

}  // namespace lazyccd
