// The groups as the kernels see them: their bounds, their primitives, and the test of whether two
// groups may touch.
#pragma once

#include <cstdint>

#include "core/bvh/group.h"
#include "gpu/scene/half_box.cuh"
#include "lazyccd/scene.h"

namespace lazyccd::gpu {

/// Axes of a group's bounds: x, y, z and the face diagonals x+y, x-y, x+z, x-z, y+z, y-z.
constexpr int kDiagonals = 6, kAxes = kSides + kDiagonals;
/// The bounds of a group: an 18-DOP (Klosowski et al. 1998). Layers that lie askew to the axes are
/// apart along a diagonal even if their boxes overlap.
struct GroupBounds {
  AxisExtent axis[kAxes];
  GroupFrame frame;  // of the boxes of its primitives
};

/// The ids of a primitive and of its vertices.
struct alignas(16) PrimitiveNames {
  std::int32_t id;
  std::int32_t vertex[3];  // unused ones -1
};

/// The places of each group begin at a multiple of this, so that its boxes begin with a sector of
/// memory.
constexpr int kPlaceUnit = 4;

/// Places behind those of the last group. The last rounds of the leaf kernel read so far beyond a
/// group.
constexpr int kReadBeyond = 64;

/// A group. Its primitives lie in places of their own without gaps: vertices, then edges, then
/// faces.
struct alignas(16) DeviceGroup {
  std::int32_t body;
  std::int32_t first_place;
  std::uint8_t count[3];
  bool pinned;
  bool meets_own_body;  // its body has self-collision

  LAZYCCD_HD int total() const { return count[0] + count[1] + count[2]; }
  /// The places that it takes.
  LAZYCCD_HD int places() const { return (total() + kPlaceUnit - 1) / kPlaceUnit * kPlaceUnit; }
};

/// Device pointers to the groups, their bounds, primitives and bodies. If `bounds` is null, opens()
/// returns true for every pair.
struct GroupView {
  const DeviceGroup* groups;
  BoxArrays boxes;        // by place, recomputed in each step
  PrimitiveNames* names;  // by place
  GroupBounds* bounds;    // recomputed in each step; may be null
  const Body* bodies;
  const std::uint64_t* disabled_pairs;  // sorted: smaller body << 32 | larger body
  std::uint32_t disabled_count;

  /// Returns whether two different bodies collide: by groups, layers and list of disabled pairs.
  __device__ bool collide(std::int32_t a, std::int32_t b) const {
    if (!filters_accept(bodies[a], bodies[b])) return false;
    const std::uint64_t lo = static_cast<std::uint32_t>(a < b ? a : b);
    const std::uint64_t key = lo << 32 | static_cast<std::uint32_t>(a < b ? b : a);
    std::uint32_t first = 0, last = disabled_count;
    while (first < last) {
      const std::uint32_t middle = first + (last - first) / 2;
      if (disabled_pairs[middle] < key) {
        first = middle + 1;
      } else {
        last = middle;
      }
    }
    return first == disabled_count || disabled_pairs[first] != key;
  }

  /// Returns whether two groups may touch, so that their primitives must be tested.
  __device__ bool opens(std::int32_t a, std::int32_t b) const {
    if (bounds == nullptr) return true;
    const DeviceGroup group_a = load_wide(groups + a), group_b = load_wide(groups + b);
    // There is no branch before the end, and several axes are loaded at a time, so that the loads
    // overlap.
    constexpr int at_once = 3;
    static_assert(kAxes % at_once == 0);
    int sign = 0;
    for (int first = 0; first < kAxes; first += at_once) {
      AxisExtent x[at_once], y[at_once];
      for (int k = 0; k < at_once; ++k) {
        x[k] = load_wide(bounds[a].axis + first + k);
        y[k] = load_wide(bounds[b].axis + first + k);
      }
      for (int k = 0; k < at_once; ++k) sign |= apart_sign(x[k], y[k]);
    }
    const bool same_body = group_a.body == group_b.body;
    const bool apart =
        (sign < 0) | (group_a.pinned & group_b.pinned) | (same_body & !group_a.meets_own_body);
    return !apart && (same_body || collide(group_a.body, group_b.body));
  }
};

}  // namespace lazyccd::gpu
