// Morton codes: 21 bits per axis, interleaved, so that close codes mean close positions (Morton
// 1966).
#pragma once

#include <cstdint>

#include "core/platform.h"

namespace lazyccd {

/// Spreads the low 21 bits of x to every third bit.
LAZYCCD_HD inline std::uint64_t spread_by_three(std::uint64_t x) {
  x &= 0x1fffff;
  x = (x | x << 32) & 0x001f00000000ffffull;
  x = (x | x << 16) & 0x001f0000ff0000ffull;
  x = (x | x << 8) & 0x100f00f00f00f00full;
  x = (x | x << 4) & 0x10c30c30c30c30c3ull;
  return (x | x << 2) & 0x1249249249249249ull;
}

/// Returns the Morton code of a point; x, y, z in [0, 1]. Values outside, and NaN, are clamped.
LAZYCCD_HD inline std::uint64_t morton_code(double x, double y, double z) {
  const auto cell = [](double v) {
    const double scaled = v * 2097151.0;
    return static_cast<std::uint64_t>(scaled > 0 ? (scaled < 2097151.0 ? scaled : 2097151.0) : 0.0);
  };
  return spread_by_three(cell(x)) << 2 | spread_by_three(cell(y)) << 1 | spread_by_three(cell(z));
}

/// The cube of the Morton codes. The scale is the same for all axes, so that its cells are cubes.
struct MortonFrame {
  double lo[3];
  double scale;  // 1 / side; 0 if all points are the same

  /// The smallest cube from the corner lo that holds the box from lo to hi.
  static LAZYCCD_HD MortonFrame around(const double* lo, const double* hi) {
    double extent = 0;
    for (int k = 0; k < 3; ++k)
      if (hi[k] - lo[k] > extent) extent = hi[k] - lo[k];
    return {{lo[0], lo[1], lo[2]}, extent > 0 ? 1 / extent : 0};
  }
  LAZYCCD_HD std::uint64_t code(const double* c) const {
    return morton_code((c[0] - lo[0]) * scale, (c[1] - lo[1]) * scale, (c[2] - lo[2]) * scale);
  }
};

/// Returns the code of the mean of `count` corners. position(corner) returns three coordinates.
template <class Position>
LAZYCCD_HD inline std::uint64_t centroid_code(const MortonFrame& frame, const std::int32_t* corners,
                                              int count, Position&& position) {
  double c[3] = {0, 0, 0};
  for (int i = 0; i < count; ++i) {
    const auto* x = position(corners[i]);
    for (int k = 0; k < 3; ++k) c[k] += static_cast<double>(x[k]) / static_cast<double>(count);
  }
  return frame.code(c);
}

/// The box of points in double, whose centre has a code.
struct PointBox {
  double lo[3], hi[3];

  /// The box of one point.
  template <class T>
  LAZYCCD_HD explicit PointBox(const T* x) {
    for (int k = 0; k < 3; ++k) lo[k] = hi[k] = x[k];
  }
  template <class T>
  LAZYCCD_HD void add(const T* x) {
    for (int k = 0; k < 3; ++k) {
      if (x[k] < lo[k]) lo[k] = x[k];
      if (x[k] > hi[k]) hi[k] = x[k];
    }
  }
  LAZYCCD_HD std::uint64_t centre_code(const MortonFrame& frame) const {
    double c[3];
    for (int k = 0; k < 3; ++k) c[k] = 0.5 * lo[k] + 0.5 * hi[k];
    return frame.code(c);
  }
};

}  // namespace lazyccd
