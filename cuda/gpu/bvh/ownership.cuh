// Groups and what they own, as in host/bvh/groups.cpp.
#pragma once

#include "core/bvh/morton.h"
#include "gpu/bvh/build_view.cuh"
#include "gpu/bvh/cell_codes.cuh"
#include "gpu/device/kernel_chain.cuh"

namespace lazyccd::gpu {

/// Writes the order of the cells and finds the first cell of every vertex and edge, one thread per
/// cell. `cells`: the sorted cells. The arrays first_of_* hold all ones before.
__global__ void claim_contents(BuildView view, const std::int32_t* cells) {
  const std::int32_t i = static_cast<std::int32_t>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i >= view.cell_count) return;
  const std::int32_t primitive = view.primitive_of(cells[i]);
  view.order[i] = primitive;
  const CellContents cell(view.contents, view.segment_of_cell(i).has_faces != 0, primitive);
  for (int k = 0; k < cell.edges; ++k)
    atomicMin(view.first_of_edge + cell.edge[k], static_cast<std::uint32_t>(i));
  for (int k = 0; k < cell.vertices; ++k)
    atomicMin(view.first_of_vertex + cell.vertex[k], static_cast<std::uint32_t>(i));
}

static_assert(kGroupCells == kWarp / 2, "a half of a warp has one lane for each cell of a group");

/// Half of a warp that works on a group, one lane per cell.
struct GroupLanes {
  std::int32_t group;
  int lane;       // 0 to 15
  unsigned mask;  // the lanes of this half

  __device__ explicit GroupLanes(std::int32_t thread)
      : group(thread / kGroupCells),
        lane(thread % kGroupCells),
        mask(0xffffu << (thread % kWarp / kGroupCells * kGroupCells)) {}
  /// Sum over the lanes.
  __device__ int sum(int x) const {
    for (int offset = kGroupCells / 2; offset > 0; offset /= 2)
      x += __shfl_xor_sync(mask, x, offset, kGroupCells);
    return x;
  }
  /// Sum over the lanes before this one.
  __device__ int sum_before(int x) const {
    const int own = x;
    for (int offset = 1; offset < kGroupCells; offset *= 2) {
      const int before = __shfl_up_sync(mask, x, offset, kGroupCells);
      if (lane >= offset) x += before;
    }
    return x - own;
  }
  __device__ bool all(bool x) const { return __all_sync(mask, x) != 0; }
};

/// Counts what each group owns, and finds its code. Half of a warp per group.
template <class Scalar>
__global__ void count_contents(BuildView view, const Scalar* start) {
  const std::int32_t thread = static_cast<std::int32_t>(blockIdx.x * blockDim.x + threadIdx.x);
  const GroupLanes lanes(thread);
  if (lanes.group >= view.group_count) return;  // all lanes of a group leave together
  const CellSegment& segment = view.segment_of_group(lanes.group);
  const CellRange range = segment.cells_of(lanes.group);
  const bool is_face = segment.has_faces != 0;
  const std::int32_t place = range.first + lanes.lane;
  const bool has_cell = place < range.last;
  // A lane without a cell looks at the first one, which changes neither box nor pins.
  const CellContents cell(view.contents, is_face, view.order[has_cell ? place : range.first]);

  OwnedContents owned{0, 0};
  if (has_cell) {
    owned = owned_contents(
        cell, static_cast<std::uint32_t>(place),
        [&](std::int32_t e) { return view.first_of_edge[e]; },
        [&](std::int32_t v) { return view.first_of_vertex[v]; });
    view.owned[place] = owned;
  }
  const auto position = [&](int k) { return start + 3 * static_cast<std::size_t>(cell.vertex[k]); };
  PointBox box(position(0));
  bool pinned = view.pinned != nullptr;
  for (int k = 0; k < cell.vertices; ++k) {
    box.add(position(k));
    pinned = pinned && view.pinned[cell.vertex[k]] != 0;
  }
  for (int offset = kGroupCells / 2; offset > 0; offset /= 2) {
    for (int k = 0; k < 3; ++k) {
      const double lo = __shfl_xor_sync(lanes.mask, box.lo[k], offset, kGroupCells);
      const double hi = __shfl_xor_sync(lanes.mask, box.hi[k], offset, kGroupCells);
      if (lo < box.lo[k]) box.lo[k] = lo;
      if (hi > box.hi[k]) box.hi[k] = hi;
    }
  }
  pinned = lanes.all(pinned);
  const int vertices = lanes.sum(__popc(owned.vertices)), edges = lanes.sum(__popc(owned.edges));
  if (lanes.lane != 0) return;
  const int faces = is_face ? range.last - range.first : 0;
  DeviceGroup group{};
  group.body = segment.body;
  group.count[kVertices] = static_cast<std::uint8_t>(vertices);
  group.count[kEdges] = static_cast<std::uint8_t>(edges);
  group.count[kFaces] = static_cast<std::uint8_t>(faces);
  group.pinned = pinned;
  group.meets_own_body = view.bodies[segment.body].self_collision;
  view.groups[lanes.group] = group;
  view.place_counts[lanes.group] = group.places();
  view.leaf_codes[lanes.group] = box.centre_code(morton_frame(view));
  view.leaf_groups[lanes.group] = lanes.group;
}

/// Names the primitives of the groups, once first_places is known. Half of a warp per group.
__global__ void name_contents(BuildView view) {
  const std::int32_t thread = static_cast<std::int32_t>(blockIdx.x * blockDim.x + threadIdx.x);
  const GroupLanes lanes(thread);
  if (lanes.group >= view.group_count) return;
  const CellSegment& segment = view.segment_of_group(lanes.group);
  const CellRange range = segment.cells_of(lanes.group);
  const bool is_face = segment.has_faces != 0;
  const std::int32_t place = range.first + lanes.lane;
  const bool has_cell = place < range.last;
  const OwnedContents owned = has_cell ? view.owned[place] : OwnedContents{0, 0};
  int vertex_at = lanes.sum_before(__popc(owned.vertices));
  int edge_at = lanes.sum_before(__popc(owned.edges));
  const std::int32_t first_place = view.first_places[lanes.group];
  DeviceGroup& group = view.groups[lanes.group];
  if (lanes.lane == 0) group.first_place = first_place;
  if (!has_cell) return;
  edge_at += group.count[kVertices];
  const int face_at = group.count[kVertices] + group.count[kEdges] + lanes.lane;
  const auto name = [&](int at, const PrimitiveNames& names) {
    view.names[first_place + at] = names;
  };
  const std::int32_t primitive = view.order[place];
  const CellContents cell(view.contents, is_face, primitive);
  for (int k = 0; k < cell.vertices; ++k)
    if (owned.vertices >> k & 1) name(vertex_at++, {cell.vertex[k], {cell.vertex[k], -1, -1}});
  for (int k = 0; k < cell.edges; ++k)
    if (owned.edges >> k & 1) name(edge_at++, {cell.edge[k], {cell.end(k, 0), cell.end(k, 1), -1}});
  if (is_face) name(face_at, {primitive, {cell.vertex[0], cell.vertex[1], cell.vertex[2]}});
}

}  // namespace lazyccd::gpu
