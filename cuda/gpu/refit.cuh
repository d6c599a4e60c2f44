// Positions to boxes: vertex records, boxes of primitives and groups, then the hierarchy.
#pragma once

#include "gpu/scene.cuh"

namespace lazyccd::gpu {

constexpr int kWarp = 32;
constexpr unsigned kAllLanes = 0xffffffffu;

__device__ inline float round_down(double x) { return __double2float_rd(x); }
__device__ inline float round_up(double x) { return __double2float_ru(x); }
__device__ inline float round_down(float x) { return x; }
__device__ inline float round_up(float x) { return x; }

// Positions beyond this would overflow the filter's single precision: the host takes that step.
constexpr double kLargestPosition = 0x1p100;

template <class Scalar, class Record>
__global__ void load_positions(SceneView scene, const Scalar* start, const Scalar* end,
                               StepCounters* counters) {
  const std::uint32_t v = blockIdx.x * blockDim.x + threadIdx.x;
  if (v >= scene.vertex_count) return;
  Record record{};
  unsigned bad = 0;
  for (int k = 0; k < 3; ++k) {
    record.x[k] = start[3 * v + k];
    record.x[3 + k] = end[3 * v + k];
  }
  for (int k = 0; k < 6; ++k) {
    const double x = record.x[k];
    if (!(fabs(x) < kLargestPosition)) bad |= isfinite(x) ? 2 : 1;
  }
  static_cast<Record*>(scene.records)[v] = record;
  if (bad) atomicOr(&counters->bad_positions, bad);
}

__device__ inline MotionBox empty_motion_box() {
  return {{INFINITY, INFINITY, INFINITY},
          {-INFINITY, -INFINITY, -INFINITY},
          {INFINITY, INFINITY, INFINITY},
          {-INFINITY, -INFINITY, -INFINITY}};
}

template <class Scalar>
__device__ inline void unite_record(MotionBox& box, const Scalar* x) {
  for (int k = 0; k < 3; ++k) {
    box.lo0[k] = fminf(box.lo0[k], round_down(x[k]));
    box.hi0[k] = fmaxf(box.hi0[k], round_up(x[k]));
    box.lo1[k] = fminf(box.lo1[k], round_down(x[3 + k]));
    box.hi1[k] = fmaxf(box.hi1[k], round_up(x[3 + k]));
  }
}

__device__ inline float sum_down(float a, float b) { return __fadd_rd(a, b); }
__device__ inline float sum_up(float a, float b) { return __fadd_ru(a, b); }
__device__ inline float sum_down(double a, double b) { return __double2float_rd(__dadd_rd(a, b)); }
__device__ inline float sum_up(double a, double b) { return __double2float_ru(__dadd_ru(a, b)); }

template <class Scalar>
__device__ inline void unite_diagonals(float (&lo)[kDiagonals], float (&hi)[kDiagonals], Scalar x,
                                       Scalar y, Scalar z) {
  const Scalar a[kDiagonals] = {x, x, x, x, y, y}, b[kDiagonals] = {y, -y, z, -z, z, -z};
  for (int k = 0; k < kDiagonals; ++k) {
    lo[k] = fminf(lo[k], sum_down(a[k], b[k]));
    hi[k] = fmaxf(hi[k], sum_up(a[k], b[k]));
  }
}

__device__ inline void unite(MotionBox& box, const FloatRecord& v) { unite_record(box, v.x); }
__device__ inline void unite(MotionBox& box, const DoubleRecord& v) { unite_record(box, v.x); }

// One warp a group.
template <class Record>
__global__ void refit_groups(SceneView scene) {
  const std::uint32_t g = (blockIdx.x * blockDim.x + threadIdx.x) / kWarp;
  const int lane = threadIdx.x % kWarp;
  if (g >= scene.group_count) return;
  const DeviceGroup group = scene.groups[g];
  const Record* records = static_cast<const Record*>(scene.records);
  MotionBox all = empty_motion_box();
  DiagonalSlabs slabs;
  for (int k = 0; k < kDiagonals; ++k) {
    slabs.lo0[k] = slabs.lo1[k] = INFINITY;
    slabs.hi0[k] = slabs.hi1[k] = -INFINITY;
  }
  for (int i = lane; i < group.total(); i += kWarp) {
    const PrimitiveNames names = scene.names[group.first + i];
    MotionBox box = empty_motion_box();
    for (int k = 0; k < 3; ++k) {
      if (names.vertex[k] < 0) break;
      const Record v = records[names.vertex[k]];
      unite(box, v);
      unite_diagonals(slabs.lo0, slabs.hi0, v.x[0], v.x[1], v.x[2]);
      unite_diagonals(slabs.lo1, slabs.hi1, v.x[3], v.x[4], v.x[5]);
    }
    scene.primitives[group.first + i].box = box;
    for (int k = 0; k < 3; ++k) {
      all.lo0[k] = fminf(all.lo0[k], box.lo0[k]);
      all.lo1[k] = fminf(all.lo1[k], box.lo1[k]);
      all.hi0[k] = fmaxf(all.hi0[k], box.hi0[k]);
      all.hi1[k] = fmaxf(all.hi1[k], box.hi1[k]);
    }
  }
  for (int offset = kWarp / 2; offset > 0; offset /= 2) {
    for (int k = 0; k < 3; ++k) {
      all.lo0[k] = fminf(all.lo0[k], __shfl_xor_sync(kAllLanes, all.lo0[k], offset));
      all.lo1[k] = fminf(all.lo1[k], __shfl_xor_sync(kAllLanes, all.lo1[k], offset));
      all.hi0[k] = fmaxf(all.hi0[k], __shfl_xor_sync(kAllLanes, all.hi0[k], offset));
      all.hi1[k] = fmaxf(all.hi1[k], __shfl_xor_sync(kAllLanes, all.hi1[k], offset));
    }
  }
  for (int k = 0; k < kDiagonals; ++k) {
    for (int offset = kWarp / 2; offset > 0; offset /= 2) {
      slabs.lo0[k] = fminf(slabs.lo0[k], __shfl_xor_sync(kAllLanes, slabs.lo0[k], offset));
      slabs.lo1[k] = fminf(slabs.lo1[k], __shfl_xor_sync(kAllLanes, slabs.lo1[k], offset));
      slabs.hi0[k] = fmaxf(slabs.hi0[k], __shfl_xor_sync(kAllLanes, slabs.hi0[k], offset));
      slabs.hi1[k] = fmaxf(slabs.hi1[k], __shfl_xor_sync(kAllLanes, slabs.hi1[k], offset));
    }
  }
  if (lane != 0) return;
  scene.boxes[g].box = all;
  scene.slabs[g] = slabs;
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
  for (int offset = kWarp / 2; offset > 0; offset /= 2) {
    for (int k = 0; k < 3; ++k) {
      box.lo[k] = fminf(box.lo[k], __shfl_xor_sync(kAllLanes, box.lo[k], offset));
      box.hi[k] = fmaxf(box.hi[k], __shfl_xor_sync(kAllLanes, box.hi[k], offset));
    }
  }
  return box;
}

__device__ inline SweptBox leaf_box(const SceneView& scene, std::int32_t slot) {
  const MotionBox b = scene.boxes[scene.leaf_order[slot]].box;
  SweptBox box;
  for (int k = 0; k < 3; ++k) {
    box.lo[k] = fminf(b.lo0[k], b.lo1[k]);
    box.hi[k] = fmaxf(b.hi0[k], b.hi1[k]);
  }
  return box;
}

// One warp a run of kRun leaves.
__global__ void refit_runs(SceneView scene, StepCounters* counters) {
  static_assert(kRun == kWarp, "a lane a leaf");
  const std::uint32_t run = (blockIdx.x * blockDim.x + threadIdx.x) / kWarp;
  const int lane = threadIdx.x % kWarp;
  if (run * kRun >= scene.group_count) return;
  const std::uint32_t slot = run * kRun + lane;
  SweptBox box = empty_box();
  float area = 0;
  if (slot < scene.group_count) {
    box = leaf_box(scene, static_cast<std::int32_t>(slot));
    const float x = box.hi[0] - box.lo[0], y = box.hi[1] - box.lo[1], z = box.hi[2] - box.lo[2];
    area = x * y + y * z + z * x;
  }
  for (int offset = kWarp / 2; offset > 0; offset /= 2)
    area += __shfl_xor_sync(kAllLanes, area, offset);
  box = united_over_warp(box);
  if (lane == 0) {
    scene.runs[run] = box;
    atomicAdd(&counters->leaf_area, area);
  }
}

// One warp a node: whole runs of its part of the leaf order, and the leaves at both ends. No node
// waits for another, as it would from the leaves upward.
__global__ void refit_nodes(SceneView scene) {
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

// A power of two that brings all differences of positions to at most 2^6 (core/elementary.h), from the
// box of the root.
__device__ inline double scene_scale(const SceneView& scene) {
  const TreeNode& root = scene.nodes[0];
  float size = 0;
  for (int k = 0; k < 3; ++k) size = fmaxf(size, root.hi[k] - root.lo[k]);
  if (!(size > 0)) return 1;
  const int exponent = 5 - ilogbf(size);
  return ldexp(1.0, exponent < -120 ? -120 : exponent > 120 ? 120 : exponent);
}

}  // namespace lazyccd::gpu
