// The groups as the kernels see them: their bounds, their primitives, and the test of whether two
// groups may touch.
#pragma once

#include <cstdint>

#include "core/bvh/group.h"
#include "lazyccd/scene.h"

namespace lazyccd::gpu {

/// An extent along one axis at the start (0) and at the end (1) of the step, rounded outward.
struct alignas(16) AxisExtent {
  float lo0, hi0, lo1, hi1;
};

/// Axes of a group's bounds: x, y, z and the face diagonals x+y, x-y, x+z, x-z, y+z, y-z.
constexpr int kSides = 3, kDiagonals = 6, kAxes = kSides + kDiagonals;
/// The bounds of a group: an 18-DOP (Klosowski et al. 1998). Layers that lie askew to the axes are
/// apart along a diagonal even if their boxes overlap.
struct GroupBounds {
  AxisExtent axis[kAxes];
};

/// The ids of a primitive and of its vertices.
struct alignas(16) PrimitiveNames {
  std::int32_t id;
  std::int32_t vertex[3];  // unused ones -1
};

/// Primitives side by side in a block. Eight extents fill a cache line.
constexpr int kLanes = 8;

/// The extents of kLanes primitives as a structure of arrays, so that the lanes of a warp read
/// whole cache lines.
struct BoxBlock {
  AxisExtent axis[kSides][kLanes];
};

/// Padding blocks behind the last group. The last rounds of the leaf kernel read up to this many
/// blocks beyond a group.
constexpr int kReadBeyond = 8;

/// A group. Its primitives fill its blocks without gaps: vertices, then edges, then faces.
struct alignas(16) DeviceGroup {
  std::int32_t body;
  std::int32_t first_block;
  std::uint8_t count[3];
  bool pinned;
  bool meets_own_body;  // its body has self-collision

  LAZYCCD_HD int total() const { return count[0] + count[1] + count[2]; }
  LAZYCCD_HD int blocks() const { return (total() + kLanes - 1) / kLanes; }
  /// Index of the names of its first primitive.
  LAZYCCD_HD std::int32_t first_name() const { return first_block * kLanes; }
};

/// Loads a T in pieces of 16 bytes. All loads are issued before the first use.
template <class T>
__device__ inline T load_wide(const T* from) {
  static_assert(sizeof(T) % sizeof(int4) == 0 && alignof(T) == sizeof(int4));
  union {
    int4 quads[sizeof(T) / sizeof(int4)];
    T value;
  } loaded;
  for (std::size_t i = 0; i < sizeof(T) / sizeof(int4); ++i)
    loaded.quads[i] = reinterpret_cast<const int4*>(from)[i];
  return loaded.value;
}

/// Returns a negative number if two extents are certainly apart during the linear motion: on the
/// same side at both ends. The sign of a difference of floats is exact. Additions and bit
/// operations on signs use other units of the multiprocessor than comparisons; it has half as many
/// units for comparisons.
__device__ inline int apart_sign(const AxisExtent& a, const AxisExtent& b) {
  return (__float_as_int(b.hi0 - a.lo0) & __float_as_int(b.hi1 - a.lo1)) |
         (__float_as_int(a.hi0 - b.lo0) & __float_as_int(a.hi1 - b.lo1));
}

/// Device pointers to the groups, their bounds, primitives and bodies. If `bounds` is null, opens()
/// returns true for every pair.
struct GroupView {
  const DeviceGroup* groups;
  BoxBlock* boxes;        // recomputed in each step
  PrimitiveNames* names;  // kLanes per block
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
