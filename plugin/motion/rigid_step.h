// The rigid displacement of a body, or of an impact zone, over one step.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>

#include "motion/motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Moves a point x to rotation (x - centre) + centre + translation.
struct RigidStep {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();       ///< metres
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  ///< metres
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();

  Eigen::Vector3d operator()(const Eigen::Vector3d& x) const {
    return rotation * (x - centre) + centre + translation;
  }
  bool stays() const { return translation.isZero(0) && rotation.isIdentity(0); }
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
