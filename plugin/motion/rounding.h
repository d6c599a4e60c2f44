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

/// Bound of the rounding along a unit vector, metres. `extent`: by axis, metres, the largest
/// coordinate of the place plus that of the origin of the frame that the place was computed in.
inline double rounding_along(const Vector3d& direction, const Vector3d& extent) {
  // Of a place: one when the application sets it, and six in the product with a pose. The rest is
  // for poses that were themselves computed.
  constexpr double rounding_count = 16;
  return rounding_count * static_cast<double>(std::numeric_limits<btScalar>::epsilon()) *
         direction.cwiseAbs().dot(extent);
}

/// The same in any direction.
inline double rounding_of(const Vector3d& extent) {
  return rounding_along(Vector3d::Ones(), extent);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
