// The tree over the sorted leaves, as in host/bvh/tree.cpp, but every node by itself
// (core/bvh/radix_tree.h).
#pragma once

#include "core/bvh/radix_tree.h"
#include "gpu/bvh/build_view.cuh"

namespace lazyccd::gpu {

/// Finds the worlds of the leaves and numbers their places, one thread per leaf.
__global__ void find_leaf_worlds(BuildView view, std::uint32_t* worlds, std::int32_t* places) {
  const std::int32_t i = static_cast<std::int32_t>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i >= view.group_count) return;
  worlds[i] = static_cast<std::uint32_t>(view.worlds[view.leaf_groups[i]] + 1);
  places[i] = i;
}

/// Moves the leaves from `places` to codes and groups, one thread per leaf.
__global__ void move_leaves(BuildView view, const std::int32_t* places, std::uint64_t* codes,
                            std::int32_t* groups) {
  const std::int32_t i = static_cast<std::int32_t>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i >= view.group_count) return;
  codes[i] = view.leaf_codes[places[i]];
  groups[i] = view.leaf_groups[places[i]];
}

/// Finds the inner nodes and links them to their parents; one thread per leaf.
__global__ void find_inner_nodes(BuildView view) {
  const std::int32_t i = static_cast<std::int32_t>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i >= view.group_count) return;
  view.leaf_order[i] = view.leaf_groups[i];
  if (i == view.group_count - 1) return;
  const LeafCodes leaves = view.leaves();
  InnerNode node{inner_node(leaves, i), 0};
  node.split = leaves.split(node.leaves.first, node.leaves.last);
  view.inner[i] = node;
  if (!node.left_is_leaf()) view.links[node.split - 1] = ParentLink::to(i, true);
  if (!node.right_is_leaf()) view.links[node.split] = ParentLink::to(i, false);
}

/// Writes the nodes, all but their boxes; one thread per inner node, which writes its leaves too.
__global__ void write_nodes(BuildView view) {
  const std::int32_t i = static_cast<std::int32_t>(blockIdx.x * blockDim.x + threadIdx.x);
  const auto write_leaf = [&](std::int32_t place, std::int32_t leaf) {
    view.nodes[place].set_leaf(view.leaf_groups[leaf]);
    view.node_ranges[place] = {leaf, leaf + 1};
  };
  if (i == 0 && view.group_count == 1) write_leaf(0, 0);
  if (i >= view.group_count - 1) return;
  const InnerNode node = view.inner[i];
  const NodePlaces places = places_of(i, view.inner, view.links);
  view.nodes[places.own].set_children(places.left, places.right,
                                      view.leaves().separates_worlds(node.split));
  view.node_ranges[places.own] = {node.leaves.first, node.leaves.last};
  if (node.left_is_leaf()) write_leaf(places.left, node.leaves.first);
  if (node.right_is_leaf()) write_leaf(places.right, node.split);
}

}  // namespace lazyccd::gpu
