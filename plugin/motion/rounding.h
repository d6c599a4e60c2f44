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

/// How often a coordinate may have been rounded: when the application computed it and when it was
/// set, and where a pose was added, for both bodies of a pair. What is multiplied by a rotation is
/// as small as a body, so it hardly counts far from the origin.
inline constexpr int rounding_count = 4;

/// Bound of the rounding of coordinates up to `largest`, metres.
inline double rounding_of(double largest) {
  return rounding_count * static_cast<double>(std::numeric_limits<btScalar>::epsilon()) * largest;
}

/// The same along a unit vector. `extent`: by axis, metres, the largest coordinate of the place
/// plus that of the origin of the frame that the place was computed in.
inline double rounding_along(const Vector3d& direction, const Vector3d& extent) {
  return rounding_of(direction.cwiseAbs().dot(extent));
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
