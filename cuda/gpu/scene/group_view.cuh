// The groups as the kernels see them: their bounds, their primitives, and whether two are worth a
// visit.
#pragma once

#include <cstdint>

#include "core/group.h"
#include "lazyccd/scene.h"

namespace lazyccd::gpu {

// An extent along one axis at both ends of the step, rounded outward.
struct alignas(16) AxisExtent {
  float lo0, hi0, lo1, hi1;
};

// Along x, y, z and the face diagonals x+y, x-y, x+z, x-z, y+z, y-z: an 18-DOP (Klosowski et al.
// 1998). Layers that lie askew are apart along a diagonal where their boxes are not.
constexpr int kSides = 3, kDiagonals = 6, kAxes = kSides + kDiagonals;
struct GroupBounds {
  AxisExtent axis[kAxes];
};

struct alignas(16) PrimitiveNames {
  std::int32_t id;
  std::int32_t vertex[3];  // unused ones -1
};

// Primitives side by side, so that the lanes of a warp read whole lines.
struct PrimitiveBlock {
  AxisExtent axis[kSides][kBlockLanes];
  PrimitiveNames names[kBlockLanes];
};

// The leaf kernel's last rounds read up to so many blocks beyond a group: there are more than
// groups have.
constexpr int kReadBeyond = 4;

// A group's primitives lie in its blocks without gaps: vertices, edges, then faces.
struct alignas(16) DeviceGroup {
  std::int32_t body;
  std::int32_t first_block;
  std::uint8_t count[3];
  bool pinned;
  bool meets_own_body;  // its body collides with itself

  LAZYCCD_HD int total() const { return count[0] + count[1] + count[2]; }
};

// Whole 16-byte loads, all under way before the first use.
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

// Negative where certainly apart in the linear motion: on the same side at both ends. The sign of a
// difference of floats is exact; additions and the logic of signs use other units of the
// multiprocessor than comparisons, of which there are half as many.
__device__ inline int apart_sign(const AxisExtent& a, const AxisExtent& b) {
  return (__float_as_int(b.hi0 - a.lo0) & __float_as_int(b.hi1 - a.lo1)) |
         (__float_as_int(a.hi0 - b.lo0) & __float_as_int(a.hi1 - b.lo1));
}

// Bodies, bounds and primitives of the groups. Without bounds every pair is worth a visit.
struct GroupView {
  const DeviceGroup* groups;
  PrimitiveBlock* blocks;  // boxes made anew each step
  GroupBounds* bounds;     // made anew each step
  const Body* bodies;
  const std::uint64_t* disabled_pairs;  // sorted: smaller body << 32 | larger body
  std::uint32_t disabled_count;

  // Different bodies.
  __device__ bool collide(std::int32_t a, std::int32_t b) const {
    if (!(bodies[a].group & bodies[b].mask) || !(bodies[b].group & bodies[a].mask)) return false;
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

  __device__ bool opens(std::int32_t a, std::int32_t b) const {
    if (bounds == nullptr) return true;
    const DeviceGroup group_a = load_wide(groups + a), group_b = load_wide(groups + b);
    // Without a branch before the end, and some axes at a time: what is loaded is under way at
    // once.
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
