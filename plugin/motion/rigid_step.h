// The rigid displacement of a body, or of an impact zone, over one step.
#pragma once

#include <cstdint>

#include "motion/motion.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Moves a point x to rotation (x - centre) + centre + translation.
struct RigidStep {
  Vector3d centre = Vector3d::Zero();       ///< metres
  Vector3d translation = Vector3d::Zero();  ///< metres
  Matrix3d rotation = Matrix3d::Identity();

  Vector3d operator()(const Vector3d& x) const {
    return rotation * (x - centre) + centre + translation;
  }
  bool stays() const { return translation.isZero() && rotation.isIdentity(); }
  bool operator==(const RigidStep& other) const {
    return translation == other.translation && centre == other.centre && rotation == other.rotation;
  }
  /// Whether a soft vertex moves the same way, up to rounding.
  bool moves_along(std::int32_t soft_vertex, const Motion& motion) const;
};

/// Displacement of a rigid body from the start of the step to its end.
RigidStep step_of(const RigidMotion& body);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
