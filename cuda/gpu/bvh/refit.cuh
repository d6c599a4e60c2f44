// Refit: computes vertex records, boxes of primitives and groups, and boxes of nodes from the
// positions.
#pragma once

#include "core/narrow/separation.h"
#include "gpu/bvh/extents.cuh"
#include "gpu/device/kernel_chain.cuh"
#include "gpu/scene/scene.cuh"

namespace lazyccd::gpu {

__device__ inline float round_down(double x) { return __double2float_rd(x); }
__device__ inline float round_up(double x) { return __double2float_ru(x); }
__device__ inline float round_down(float x) { return x; }
__device__ inline float round_up(float x) { return x; }

/// Largest coordinate that the filter's single precision can take without overflow. If one is
/// larger, the host does the step.
constexpr double kLargestPosition = 0x1p100;

/// The caller's positions on the device, three scalars per vertex.
template <class Scalar>
struct PositionView {
  const Scalar *start, *end;
};

template <class Record, class Scalar>
__device__ inline Record load_record(const PositionView<Scalar>& positions, std::int32_t v) {
  Record record{};
  for (int k = 0; k < 3; ++k) {
    record.x[k] = positions.start[3 * v + k];
    record.x[3 + k] = positions.end[3 * v + k];
  }
  return record;
}

/// Returns bits: 1 if a coordinate is not finite, 2 if one is too large.
template <class Record>
__device__ inline unsigned bad_bits(const Record& record) {
  unsigned bad = 0;
  for (int k = 0; k < 6; ++k) {
    const double x = record.x[k];
    if (!(fabs(x) < kLargestPosition)) bad |= isfinite(x) ? 2 : 1;
  }
  return bad;
}

__device__ inline float sum_down(float a, float b) { return __fadd_rd(a, b); }
__device__ inline float sum_up(float a, float b) { return __fadd_ru(a, b); }
__device__ inline float sum_down(double a, double b) { return __double2float_rd(__dadd_rd(a, b)); }
__device__ inline float sum_up(double a, double b) { return __double2float_ru(__dadd_ru(a, b)); }

/// Computes the extents of a vertex along x, y and z.
template <class Record>
__device__ inline void side_extents(const Record& v, AxisExtent (&e)[kSides]) {
  for (int k = 0; k < kSides; ++k)
    e[k] = {round_down(v.x[k]), round_up(v.x[k]), round_down(v.x[3 + k]), round_up(v.x[3 + k])};
}

/// Widens an extent by `margin` on both sides. With a minimum separation every extent is widened.
/// The margin along a diagonal is sqrt 2 times as large, because the diagonal's vector has length
/// sqrt 2.
__device__ inline void grow(AxisExtent& e, double margin) {
  e = {round_down(__dsub_rd(e.lo0, margin)), round_up(__dadd_ru(e.hi0, margin)),
       round_down(__dsub_rd(e.lo1, margin)), round_up(__dadd_ru(e.hi1, margin))};
}

/// Adds a vertex to the extents along the diagonals.
template <class Record>
__device__ inline void unite_diagonals(AxisExtent (&e)[kDiagonals], const Record& v) {
  constexpr int from[kDiagonals] = {0, 0, 0, 0, 1, 1}, to[kDiagonals] = {1, 1, 2, 2, 2, 2};
  for (int k = 0; k < kDiagonals; ++k) {
    const auto a0 = v.x[from[k]], a1 = v.x[3 + from[k]];
    const auto b0 = k % 2 ? -v.x[to[k]] : v.x[to[k]], b1 = k % 2 ? -v.x[3 + to[k]] : v.x[3 + to[k]];
    unite(e[k], {sum_down(a0, b0), sum_up(a0, b0), sum_down(a1, b1), sum_up(a1, b1)});
  }
}

__device__ inline SweptBox empty_box() {
  return {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
}

__device__ inline void unite(SweptBox& a, const SweptBox& b) {
  for (int k = 0; k < 3; ++k) {
    a.lo[k] = fminf(a.lo[k], b.lo[k]);
    a.hi[k] = fmaxf(a.hi[k], b.hi[k]);
  }
}

__device__ inline SweptBox united_over_warp(SweptBox box) {
  for (int k = 0; k < 3; ++k) {
    box.lo[k] = warp_min(box.lo[k]);
    box.hi[k] = warp_max(box.hi[k]);
  }
  return box;
}

/// Returns the swept box of the leaf at `slot` of the leaf order.
__device__ inline SweptBox leaf_box(const SceneView& scene, std::int32_t slot) {
  const AxisExtent* axis = scene.groups.bounds[scene.leaf_order[slot]].axis;
  SweptBox box;
  for (int k = 0; k < kSides; ++k) {
    const AxisExtent e = load_wide(axis + k);
    box.lo[k] = fminf(e.lo0, e.lo1);
    box.hi[k] = fmaxf(e.hi0, e.hi1);
  }
  return box;
}

/// The extents of a primitive, grown by `margin`. Each of its vertices is added to the extents
/// along the diagonals too, if they are given.
template <class Record, class Scalar>
__device__ inline void primitive_extents(const PositionView<Scalar>& positions,
                                         const PrimitiveNames& names, double margin,
                                         AxisExtent (&own)[kSides],
                                         AxisExtent (*diagonals)[kDiagonals]) {
  for (auto& e : own) e = empty_extent();
  for (int k = 0; k < 3; ++k) {
    if (names.vertex[k] < 0) break;
    const Record v = load_record<Record>(positions, names.vertex[k]);
    AxisExtent at[kSides];
    side_extents(v, at);
    for (int axis = 0; axis < kSides; ++axis) unite(own[axis], at[axis]);
    if (diagonals != nullptr) unite_diagonals(*diagonals, v);
  }
  if (margin > 0)
    for (auto& e : own) grow(e, margin);
}

/// Refits the boxes of a group and of its primitives, by one warp. Returns the group's swept box in
/// all lanes. The primitives are visited twice, because their boxes are stored relative to the
/// group's.
template <class Record, class Scalar>
__device__ inline SweptBox refit_group(const SceneView& scene,
                                       const PositionView<Scalar>& positions, std::int32_t g,
                                       int lane) {
  const DeviceGroup group = load_wide(scene.groups.groups + g);
  const PrimitiveNames* const names = scene.groups.names + group.first_place;
  const double margin = separation_margin(scene.separation.between_bodies);
  AxisExtent sides[kSides], diagonals[kDiagonals], own[kSides];
  for (auto& e : sides) e = empty_extent();
  for (auto& e : diagonals) e = empty_extent();
  for (int i = lane; i < group.total(); i += kWarp) {
    primitive_extents<Record>(positions, load_wide(names + i), margin, own, nullptr);
    for (int axis = 0; axis < kSides; ++axis) unite(sides[axis], own[axis]);
  }
  for (auto& e : sides) e = united_over_warp(e);
  const GroupFrame frame = GroupFrame::around(sides);
  for (int i = lane; i < group.total(); i += kWarp) {
    primitive_extents<Record>(positions, load_wide(names + i), margin, own, &diagonals);
    scene.groups.boxes.store(group.first_place + i, HalfBox::in_frame(own, frame));
  }
  // Nothing overlaps an empty box.
  const bool active = scene.detects(group.body);
  AxisExtent mine = empty_extent();
  SweptBox box;
  for (int k = 0; k < kAxes; ++k) {
    AxisExtent e = k < kSides ? sides[k] : united_over_warp(diagonals[k - kSides]);
    if (scene.separation.between_bodies > 0 && k >= kSides)
      grow(e, __dmul_ru(separation_margin(scene.separation.between_bodies), 1.4142135623731));
    if (!active) e = empty_extent();
    if (lane == k) mine = e;
    if (k >= kSides) continue;
    box.lo[k] = fminf(e.lo0, e.lo1);
    box.hi[k] = fmaxf(e.hi0, e.hi1);
  }
  GroupBounds& bounds = scene.groups.bounds[g];
  if (lane < kAxes) bounds.axis[lane] = mine;
  if (lane == kAxes) bounds.frame = frame;
  return box;
}

/// Threads of a block of the refit: one warp per leaf of a run.
constexpr std::uint32_t kRefitBlock = kRun * kWarp;
/// Returns the number of runs of leaves.
LAZYCCD_HD inline std::uint32_t run_count(const SceneView& scene) {
  return (scene.group_count + kRun - 1) / kRun;
}

/// Refits groups and vertices. The first blocks take the groups, one warp per group in the order of
/// the leaves, and then unite the run's box from theirs. The other blocks write the vertex records,
/// one thread per vertex. Needs nothing from earlier kernels of the step but cleared counters.
template <class Scalar, class Record>
__global__ void __launch_bounds__(kRefitBlock, 1024 / kRefitBlock)
    refit_groups(SceneView scene, PositionView<Scalar> positions, StepCounters* counters) {
  let_next_kernel_in();
  const std::uint32_t runs = run_count(scene);
  if (blockIdx.x >= runs) {
    const std::uint32_t v = (blockIdx.x - runs) * kRefitBlock + threadIdx.x;
    unsigned bad = 0;
    if (v < scene.vertex_count) {
      const Record record = load_record<Record>(positions, static_cast<std::int32_t>(v));
      static_cast<Record*>(scene.records)[v] = record;
      bad = bad_bits(record);
      // Nothing is decided from the positions of bodies that are left out.
      if (bad != 0 && !scene.detects(scene.mesh.body_of_vertex[v])) bad = 0;
    }
    await_kernels_before();
    if (bad) atomicOr(&counters->bad_positions, bad);
    return;
  }
  __shared__ SweptBox leaves[kRun];
  const int lane = threadIdx.x % kWarp, leaf = threadIdx.x / kWarp;
  const std::uint32_t slot = blockIdx.x * kRun + leaf;
  if (slot < scene.group_count) {
    const SweptBox box = refit_group<Record>(scene, positions, scene.leaf_order[slot], lane);
    if (lane == 0) leaves[leaf] = box;
  }
  __syncthreads();
  if (leaf != 0) return;
  SweptBox box = empty_box();
  float area = 0;
  if (blockIdx.x * kRun + lane < scene.group_count && lane < kRun) {
    box = leaves[lane];
    const auto side = [&](int k) { return fmaxf(box.hi[k] - box.lo[k], 0.0f); };
    const float x = side(0), y = side(1), z = side(2);
    area = x * y + y * z + z * x;
  }
  for (int offset = kWarp / 2; offset > 0; offset /= 2)
    area += __shfl_xor_sync(kAllLanes, area, offset);
  box = united_over_warp(box);
  await_kernels_before();
  if (lane == 0) {
    scene.runs[blockIdx.x] = box;
    atomicAdd(&counters->leaf_area, area);
  }
}

/// Refits the boxes of the nodes, one warp per node: from the whole runs of its part of the leaf
/// order, and the leaves at both ends. No node waits for another, as it would in a refit from the
/// leaves upward.
__global__ void refit_nodes(SceneView scene) {
  begin_kernel();
  const std::uint32_t n = (blockIdx.x * blockDim.x + threadIdx.x) / kWarp;
  const int lane = threadIdx.x % kWarp;
  if (n >= scene.node_count) return;
  const int2 range = scene.node_ranges[n];
  const int first_run = (range.x + kRun - 1) / kRun, last_run = range.y / kRun;
  SweptBox box = empty_box();
  if (first_run < last_run) {
    for (int r = first_run + lane; r < last_run; r += kWarp) unite(box, scene.runs[r]);
    if (range.x + lane < first_run * kRun) unite(box, leaf_box(scene, range.x + lane));
    if (last_run * kRun + lane < range.y) unite(box, leaf_box(scene, last_run * kRun + lane));
  } else {
    for (int i = range.x + lane; i < range.y; i += kWarp) unite(box, leaf_box(scene, i));
  }
  box = united_over_warp(box);
  if (lane < 3) {
    // Constant indices keep the box in registers.
    scene.nodes[n].lo[lane] = lane == 0 ? box.lo[0] : lane == 1 ? box.lo[1] : box.lo[2];
    scene.nodes[n].hi[lane] = lane == 0 ? box.hi[0] : lane == 1 ? box.hi[1] : box.hi[2];
  }
}

}  // namespace lazyccd::gpu
