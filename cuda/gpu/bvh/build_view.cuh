// What the kernels that build a hierarchy read and write.
#pragma once

#include <cuda_runtime_api.h>

#include <cstdint>

#include "core/bvh/cell.h"
#include "core/bvh/radix_tree.h"
#include "gpu/scene/scene.cuh"

namespace lazyccd::gpu {

/// Device pointers, passed by value.
struct BuildView {
  // Of the mesh.
  CellView contents;
  const std::int32_t* primitives;  // by cell: index of its face or edge; null: its own index
  const CellSegment* segments;
  std::int32_t vertex_count, cell_count, segment_count, group_count;
  const unsigned char* pinned;  // by vertex; null if no vertex is pinned
  const Body* bodies;
  const std::int32_t* worlds;  // by group, ascending; null: all bodies are in one world

  // Work space.
  long long* bounds;    // of the vertices at the start: three lower, three upper, ordered
  std::int32_t* order;  // cells' faces or edges, in the order from which groups are cut
  std::uint32_t* first_of_vertex;  // place in `order` of the first cell that contains it
  std::uint32_t* first_of_edge;
  OwnedContents* owned;        // by place in `order`
  std::int32_t* place_counts;  // by group
  std::int32_t* first_places;  // by group: sum of place_counts before it
  std::uint64_t* leaf_codes;   // by group; then sorted
  std::int32_t* leaf_groups;   // the groups of leaf_codes
  InnerNode* inner;
  ParentLink* links;

  // The hierarchy.
  DeviceGroup* groups;
  PrimitiveNames* names;
  std::int32_t* leaf_order;
  int2* node_ranges;
  TreeNode* nodes;

  __device__ std::int32_t primitive_of(std::int32_t cell) const {
    return primitives == nullptr ? cell : primitives[cell];
  }
  /// The leaves, sorted.
  __device__ LeafCodes leaves() const { return {leaf_codes, group_count, worlds}; }
  /// The segment that contains a cell.
  __device__ const CellSegment& segment_of_cell(std::int32_t cell) const {
    return segments[last_at_most(cell, [](const CellSegment& s) { return s.first; })];
  }
  __device__ const CellSegment& segment_of_group(std::int32_t group) const {
    return segments[last_at_most(group, [](const CellSegment& s) { return s.first_group; })];
  }
  __device__ std::int32_t segment_index(std::int32_t cell) const {
    return last_at_most(cell, [](const CellSegment& s) { return s.first; });
  }

 private:
  template <class Key>
  __device__ std::int32_t last_at_most(std::int32_t value, Key&& key) const {
    std::int32_t first = 0, count = segment_count;
    while (count > 1) {
      const std::int32_t half = count / 2;
      if (key(segments[first + half]) <= value) {
        first += half;
        count -= half;
      } else {
        count = half;
      }
    }
    return first;
  }
};

}  // namespace lazyccd::gpu
