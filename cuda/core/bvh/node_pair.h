// One step of the traversal (da Silva, Algorithm 2.1): what becomes of a pair of tree nodes.
#pragma once

#include <cstdint>

#include "core/bvh/tree.h"
#include "core/platform.h"

namespace lazyccd {

/// A pair of tree nodes, or any two 32-bit ids.
struct alignas(8) NodePair {
  std::uint32_t a, b;
};

/// The result of a visit. A pair that overlaps is expanded into pairs of children, down to pairs of
/// leaves. A pair of a node with itself overlaps.
struct PairVisit {
  bool overlaps;  // if true and without children, it is a pair of leaves to test
  int children;  // number of child pairs; 0: the traversal ends here, the pair belongs to the front
  NodePair child[3];
};

/// Visits a pair: tests whether the nodes overlap and expands the larger one, or both if they are
/// the same node. From the root on, pairs of different worlds never arise: their only common node
/// separates them.
LAZYCCD_HD inline PairVisit visit(NodePair pair, const TreeNode& a, const TreeNode& b) {
  const auto id = [](std::int32_t node) { return static_cast<std::uint32_t>(node); };
  const bool same = pair.a == pair.b;
  if (!same && !overlap(a, b)) return {false, 0, {}};
  if (a.leaf() && b.leaf()) return {true, 0, {}};
  if (same) {
    const NodePair left{id(a.left), id(a.left)}, right{id(a.right()), id(a.right())};
    if (a.separates_worlds()) return {true, 2, {left, right}};
    return {true, 3, {{left.a, right.a}, left, right}};
  }
  if (b.leaf() || (!a.leaf() && extent(a) >= extent(b)))
    return {true, 2, {{id(a.left), pair.b}, {id(a.right()), pair.b}}};
  return {true, 2, {{pair.a, id(b.left)}, {pair.a, id(b.right())}}};
}

}  // namespace lazyccd
