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

}  // namespace lazyccd
