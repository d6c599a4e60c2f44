// The scale of the elementary tests (core/narrow/elementary.h).
#pragma once

#include <algorithm>
#include <cmath>

namespace lazyccd {

/// Returns a power of two that brings numbers up to `size` to at most 2^6, if a double can hold it.
/// Returns 1 if `size` is not a positive finite number.
inline double scale_for(double size) {
  if (!(size > 0) || !std::isfinite(size)) return 1;
  return std::ldexp(1.0, std::clamp(5 - std::ilogb(size), -1020, 1000));
}

}  // namespace lazyccd
