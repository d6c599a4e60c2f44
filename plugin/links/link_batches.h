// Divides the links of soft bodies into groups (link_kernels.h). Solving the groups in order gives
// the same result, to the bit, as solving the links one after the other: if links share a node,
// each is in a later group than the ones listed before it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "links/link_kernels.h"

namespace lazyccd::bullet {

/// Indices of the two nodes of each link, which may be the same node; `no_nodes` if the link is
/// left out.
using LinkEnds = std::vector<std::array<std::int32_t, 2>>;
constexpr std::array<std::int32_t, 2> no_nodes = {-1, -1};

/// Assignment of links to groups.
struct LinkBatches {
  /// Group of a link, and its lane in the group. Negative if the link is left out.
  struct Place {
    std::int32_t group, lane;
  };
  std::vector<Place> places;        ///< by link
  std::vector<std::int32_t> sizes;  ///< number of links, by group
  /// Number of nodes: the body's, and one dummy node for each group that is not full.
  std::int32_t nodes = 0;
  /// Largest span of groups that use one node: from the first such group to the last one, both
  /// included. At least 1.
  std::int32_t skew = 1;
};

/// Plans the groups of a body with `nodes` nodes. Each link goes into the first group that comes
/// after the groups of its nodes so far and has fewer than `lanes` links.
LinkBatches plan_links(const LinkEnds& ends, std::int32_t nodes, std::int32_t lanes);

/// Offset in bytes from the first node of a body to node `count`.
template <class Scalar>
constexpr std::uint32_t bytes_of_nodes(std::int32_t count) {
  return static_cast<std::uint32_t>(count) * static_cast<std::uint32_t>(sizeof(LinkedNode<Scalar>));
}

/// Makes the groups of a plan whose number of lanes is LinkGroup<Scalar>::links. Sets only the node
/// offsets of the links; all other values are those of a missing link and must be filled in.
template <class Scalar>
std::vector<LinkGroup<Scalar>> make_groups(const LinkBatches& plan, const LinkEnds& ends);

}  // namespace lazyccd::bullet
