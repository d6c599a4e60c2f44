// A step of the traversal (dissertation, Algorithm 2.1): what becomes of a pair of tree nodes.
#pragma once

#include <cstdint>

#include "core/platform.h"
#include "core/tree.h"

namespace lazyccd {

// A pair of tree nodes, or any two 32-bit ids.
struct alignas(8) NodePair {
  std::uint32_t a, b;
};

// A pair that overlaps is opened, down to pairs of leaves. A node with itself overlaps.
struct PairVisit {
  bool near;           // overlaps; where it has no children: a pair of leaves to look into
  int children;        // 0: the traversal ends here, and the pair belongs to the front
  NodePair child[3];
};

LAZYCCD_HD inline PairVisit visit(NodePair pair, const TreeNode& a, const TreeNode& b) {
  const auto id = [](std::int32_t node) { return static_cast<std::uint32_t>(node); };
  const bool same = pair.a == pair.b;
  if (!same && !overlap(a, b)) return {false, 0, {}};
  if (a.leaf() && b.leaf()) return {true, 0, {}};
  if (same)
    return {true, 3, {{id(a.left), id(a.right)}, {id(a.left), id(a.left)}, {id(a.right), id(a.right)}}};
  if (b.leaf() || (!a.leaf() && extent(a) >= extent(b)))
    return {true, 2, {{id(a.left), pair.b}, {id(a.right), pair.b}}};
  return {true, 2, {{pair.a, id(b.left)}, {pair.a, id(b.right)}}};
}

}  // namespace lazyccd
