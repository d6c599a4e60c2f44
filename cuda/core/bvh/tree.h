// The nodes of the binary hierarchy over the groups.
#pragma once

#include <cstdint>

#include "core/platform.h"

namespace lazyccd {

/// A node, 32 bytes. Node 0 is the root; a parent comes before its children. A leaf has left = -1 -
/// group.
struct TreeNode {
  float lo[3], hi[3];  // swept box: over both ends of the step
  std::int32_t left;
  std::int32_t right_link;  // the right child; its complement if the children are in other worlds

  LAZYCCD_HD bool leaf() const { return left < 0; }
  LAZYCCD_HD std::int32_t group() const { return -1 - left; }
  LAZYCCD_HD std::int32_t right() const { return right_link < 0 ? ~right_link : right_link; }
  /// Whether the two children share no world. Then nothing below one meets anything below the
  /// other. Only for inner nodes.
  LAZYCCD_HD bool separates_worlds() const { return right_link < 0; }

  LAZYCCD_HD void set_leaf(std::int32_t group) {
    left = -1 - group;
    right_link = -1;
  }
  LAZYCCD_HD void set_children(std::int32_t l, std::int32_t r, bool separates) {
    left = l;
    right_link = separates ? ~r : r;
  }
};

LAZYCCD_HD inline bool overlap(const TreeNode& a, const TreeNode& b) {
  return a.lo[0] <= b.hi[0] && b.lo[0] <= a.hi[0] && a.lo[1] <= b.hi[1] && b.lo[1] <= a.hi[1] &&
         a.lo[2] <= b.hi[2] && b.lo[2] <= a.hi[2];
}

/// Where a search for all that meets one node goes on from an inner node.
struct ChildrenToVisit {
  int count;
  std::int32_t node[2];
};

/// The children of `n` that a search for what meets the node `self` visits. If n separates worlds
/// and self is below n, only the child with self. If self is elsewhere, it is in every world and
/// comes before n.left, so both. Nodes must be numbered as in Tree (host/bvh/tree.h).
LAZYCCD_HD inline ChildrenToVisit children_to_visit(const TreeNode* nodes, const TreeNode& n,
                                                    std::int32_t self) {
  const std::int32_t right = n.right();
  if (!n.separates_worlds() || self < n.left) return {2, {n.left, right}};
  const bool is_left =
      self != right && (self == n.left || nodes[right].leaf() || self < nodes[right].left);
  return {1, {is_left ? n.left : right, -1}};
}

/// The sum of the sides. It decides which node of a pair to expand: the larger one.
LAZYCCD_HD inline float extent(const TreeNode& n) {
  return (n.hi[0] - n.lo[0]) + (n.hi[1] - n.lo[1]) + (n.hi[2] - n.lo[2]);
}

}  // namespace lazyccd
