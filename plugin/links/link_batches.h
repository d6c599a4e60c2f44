// In which groups the links of a soft body are solved (links.h), so that it comes to the same, to
// the bit, as one after the other: of those that share a node, each is in a later group than the
// ones listed before it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "links/link_kernels.h"

namespace lazyccd::bullet {

// By link, the indices of its two nodes, which may be one; `no_nodes` where it is left out.
using LinkEnds = std::vector<std::array<std::int32_t, 2>>;
constexpr std::array<std::int32_t, 2> no_nodes = {-1, -1};

struct LinkBatches {
  // By link: its group, and its place there. Negative where it is left out.
  struct Place {
    std::int32_t group, lane;
  };
  std::vector<Place> places;
  std::vector<std::int32_t> sizes;  // by group: links
  std::int32_t nodes = 0;           // the body's, and one for each group with room
  // From the first group of a node to the last one, both counted: the most of any node; at least 1.
  std::int32_t skew = 1;
};

// Of a body of so many nodes: each link goes into the first group after those of its nodes that has
// less than `lanes`.
LinkBatches plan_links(const LinkEnds& ends, std::int32_t nodes, std::int32_t lanes);

// From the first node of a body to the one of that index.
template <class Scalar>
constexpr std::uint32_t bytes_of_nodes(std::int32_t count) {
  return static_cast<std::uint32_t>(count) * static_cast<std::uint32_t>(sizeof(LinkedNode<Scalar>));
}

// The groups of a plan for as many lanes as they have, but for what else than their nodes links
// say: that is as in place of missing ones.
template <class Scalar>
std::vector<LinkGroup<Scalar>> make_groups(const LinkBatches& plan, const LinkEnds& ends);

}  // namespace lazyccd::bullet
