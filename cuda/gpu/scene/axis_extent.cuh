// Extents along an axis over a step, and whether two of them are apart.
#pragma once

#include <cuda_runtime.h>

#include <cstddef>

namespace lazyccd::gpu {

/// An extent along one axis at the start (0) and at the end (1) of the step, rounded outward.
struct alignas(16) AxisExtent {
  float lo0, hi0, lo1, hi1;
};

constexpr int kSides = 3;  ///< axes of a box: x, y, z

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

}  // namespace lazyccd::gpu
