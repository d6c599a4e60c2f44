// Finds the bodies whose surfaces are closed, and tests whether a point is inside of one.
#pragma once

#include <cstdint>
#include <vector>

#include "lazyccd/scene.h"
#include "motion/motion.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// True if there are faces and each of their sides belongs to exactly two of them.
bool is_closed_mesh(const Topology& topology, const std::vector<std::int32_t>& faces);

/// Volume within the faces of a closed mesh at the start of the step, m^3: negative if they point
/// inwards.
double volume_of(const Topology& topology, const Motion& motion,
                 const std::vector<std::int32_t>& faces);

/// How often the faces wind around the point at the start of the step: 0 outside of a closed mesh,
/// 1 inside, or -1 if its faces are oriented inwards.
double winding_number(const Topology& topology, const Motion& motion,
                      const std::vector<std::int32_t>& faces, const Vector3d& point);

class ClosedSurfaces {
 public:
  /// Uses the positions at the start of the step. `motion` and the arrays that `topology` refers to
  /// must outlive this object.
  ClosedSurfaces(const Topology& topology, const Motion& motion);

  /// True if the faces of the body are a closed mesh. Those of a rigid body must also point
  /// outwards: others are rooms.
  bool is_closed(std::int32_t body) const { return closed_[body] != 0; }
  /// True if the point is inside of the body. Call only if the surface is closed.
  bool contains(std::int32_t body, const Vector3d& point) const;

 private:
  bool is_soft(const std::vector<std::int32_t>& faces) const;

  Topology topology_;
  const Motion& motion_;
  std::vector<std::vector<std::int32_t>> faces_;  ///< indices of faces, by body
  std::vector<char> closed_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
