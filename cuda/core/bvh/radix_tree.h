// The binary radix tree over leaves in Morton order. Every node can be found by itself. See Karras,
// "Maximizing Parallelism in the Construction of BVHs, Octrees, and k-d Trees", HPG 2012.
//
// A node is split at the highest bit in which the keys below it differ. The key of a leaf is its
// world, its code and, among equal codes, its place in the order.
#pragma once

#include <cstdint>

#include "core/platform.h"

namespace lazyccd {

/// Number of zero bits of 64 above the highest set bit; x is not 0.
LAZYCCD_HD inline int leading_zeros(std::uint64_t x) {
#if defined(__CUDA_ARCH__)
  return __clzll(static_cast<long long>(x));
#elif defined(__GNUC__) || defined(__clang__)
  return __builtin_clzll(x);
#else
  int zeros = 0;
  for (int half = 32; half > 0; half /= 2)
    if (x >> (64 - half) == 0) {
      zeros += half;
      x <<= half;
    }
  return zeros;
#endif
}

/// The codes of the leaves, sorted within each world; at least one. Leaves of every world (-1) come
/// first, then those of world 0, and so on. The keys of world -1 differ from the others in their
/// sign, so they are the left part of the root, which does not count as separating worlds.
struct LeafCodes {
  const std::uint64_t* codes;
  std::int32_t count;
  const std::int32_t* worlds;  // by leaf; null: all leaves are in one world

  /// Number of leading bits in which the keys of two different leaves agree.
  LAZYCCD_HD int common_bits(std::int32_t i, std::int32_t j) const {
    constexpr int world_bits = 32;
    if (worlds != nullptr && worlds[i] != worlds[j])
      return leading_zeros(static_cast<std::uint32_t>(worlds[i] ^ worlds[j])) - world_bits;
    const std::uint64_t differing = codes[i] ^ codes[j];
    if (differing != 0) return world_bits + leading_zeros(differing);
    return world_bits + 64 + leading_zeros(static_cast<std::uint64_t>(i ^ j));
  }
  /// Whether the leaves before `split` share no world with the others of a node that is split
  /// there.
  LAZYCCD_HD bool separates_worlds(std::int32_t split) const {
    return worlds != nullptr && worlds[split - 1] >= 0 && worlds[split - 1] != worlds[split];
  }
  /// The same; -1 if leaf j does not exist.
  LAZYCCD_HD int common_bits_or_none(std::int32_t i, std::int32_t j) const {
    return j < 0 || j >= count ? -1 : common_bits(i, j);
  }

  /// Returns where to split the leaves [first, last), two at least: the first leaf of the upper
  /// part.
  LAZYCCD_HD std::int32_t split(std::int32_t first, std::int32_t last) const {
    const int bits = common_bits(first, last - 1);
    std::int32_t below = first, above = last - 1;  // last leaf known below the split, first above
    while (above - below > 1) {
      const std::int32_t middle = below + (above - below) / 2;
      if (common_bits(first, middle) > bits) {
        below = middle;
      } else {
        above = middle;
      }
    }
    return above;
  }
};

/// The leaves [first, last) below a node.
struct LeafRange {
  std::int32_t first, last;
};

/// Returns the leaves of the inner node that begins or ends at leaf i, the one that is not the
/// smaller child of its parent. Different leaves i < count - 1 give different nodes; 0 is the root.
LAZYCCD_HD inline LeafRange inner_node(const LeafCodes& leaves, std::int32_t i) {
  const int before = leaves.common_bits_or_none(i, i - 1);
  const int behind = leaves.common_bits_or_none(i, i + 1);
  const std::int32_t direction = behind > before ? 1 : -1;
  const int outside = behind > before ? before : behind;
  const auto inside = [&](std::int32_t distance) {
    return leaves.common_bits_or_none(i, i + distance * direction) > outside;
  };
  std::int32_t reach = 2;
  while (inside(reach)) reach *= 2;
  std::int32_t length = 0;
  for (std::int32_t step = reach / 2; step > 0; step /= 2)
    if (inside(length + step)) length += step;
  return direction > 0 ? LeafRange{i, i + length + 1} : LeafRange{i - length, i + 1};
}

/// An inner node, by the numbering of inner_node(). Its children are inner nodes split - 1 and
/// split, or leaves of these numbers.
struct InnerNode {
  LeafRange leaves;
  std::int32_t split;  // first leaf of the right child

  LAZYCCD_HD bool left_is_leaf() const { return split - leaves.first == 1; }
  LAZYCCD_HD bool right_is_leaf() const { return leaves.last - split == 1; }
};

/// The parent of an inner node, and on which side of it the node is.
struct ParentLink {
  std::uint32_t bits;

  LAZYCCD_HD static ParentLink to(std::int32_t parent, bool is_left) {
    return {static_cast<std::uint32_t>(parent) << 1 | static_cast<std::uint32_t>(is_left)};
  }
  LAZYCCD_HD std::int32_t parent() const { return static_cast<std::int32_t>(bits >> 1); }
  LAZYCCD_HD std::uint32_t is_left() const { return bits & 1; }
};

/// Where an inner node and its children lie among the nodes of a Tree (host/bvh/tree.h). There the
/// children of the i-th inner node in preorder are nodes 1 + 2 i and 2 + 2 i.
struct NodePlaces {
  std::int32_t own, left, right;
};

/// In preorder, the inner nodes before a node are all above it, and those on its left. The latter
/// are as many as its first leaf has leaves before it, less the nodes above it of whose right part
/// it is. So only the nodes above it of whose left part it is must be counted.
LAZYCCD_HD inline NodePlaces places_of(std::int32_t node, const InnerNode* inner,
                                       const ParentLink* links) {
  std::int32_t lefts = 0;
  for (std::int32_t i = node; i != 0; i = links[i].parent())
    lefts += static_cast<std::int32_t>(links[i].is_left());
  const std::int32_t rank = inner[node].leaves.first + lefts;
  std::int32_t own = 0;
  if (node != 0) {
    const ParentLink link = links[node];
    const std::int32_t is_left = static_cast<std::int32_t>(link.is_left());
    const std::int32_t parent_rank = inner[link.parent()].leaves.first + lefts - is_left;
    own = 2 * parent_rank + (is_left != 0 ? 1 : 2);
  }
  return {own, 1 + 2 * rank, 2 + 2 * rank};
}

}  // namespace lazyccd
