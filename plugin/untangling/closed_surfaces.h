// Finds the bodies whose surfaces are closed, and tests whether a point is inside of one.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "lazyccd/scene.h"
#include "motion/motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class ClosedSurfaces {
 public:
  /// Uses the positions at the start of the step. `motion` and the arrays that `topology` refers to
  /// must outlive this object.
  ClosedSurfaces(const Topology& topology, const Motion& motion);

  /// True if the body has faces and each of their sides belongs to exactly two faces.
  bool is_closed(std::int32_t body) const { return closed_[body] != 0; }
  /// True if the point is inside of the body. Call only if the surface is closed.
  bool contains(std::int32_t body, const Eigen::Vector3d& point) const;

 private:
  Topology topology_;
  const Motion& motion_;
  std::vector<std::vector<std::int32_t>> faces_;  ///< indices of faces, by body
  std::vector<char> closed_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
