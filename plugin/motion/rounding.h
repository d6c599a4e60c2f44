// How far positions can be from where they were meant to be, because scalars are rounded.
//
// Every test of "inside or outside" at the start of a step uses this bound. Less than it counts as
// zero, and zero is outside: touching_starts.h moves what is there out of the bound.
#pragma once

#include <limits>

#include "lazyccd/bullet/precision.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Bound of the rounding of coordinates up to `largest`, metres.
inline double rounding_of(double largest) {
  // One when the application sets a place, and six in the product with a pose. The rest is for
  // poses that were themselves computed.
  constexpr double rounding_count = 16;
  return rounding_count * static_cast<double>(std::numeric_limits<btScalar>::epsilon()) * largest;
}

/// The same along a unit vector. `extent`: by axis, metres, the largest coordinate of the place
/// plus that of the origin of the frame that the place was computed in.
inline double rounding_along(const Vector3d& direction, const Vector3d& extent) {
  return rounding_of(direction.cwiseAbs().dot(extent));
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
