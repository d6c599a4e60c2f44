// Penetrations of convex bodies.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/step_topology.h"
#include "untangling/penetration_list.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// What is in the way of what comes out of an obstacle.
struct Blocking {
  bool is_movable = false;          ///< the obstacle itself gives way, and nothing is blocked
  std::vector<std::int32_t> faces;  ///< around it, of obstacles that nothing moves
  double margin = 0;                ///< metres: what comes out keeps this distance from the faces
};

/// What may penetrate one part of an obstacle.
struct Candidates {
  /// Soft vertices that collide with the obstacle and can be moved out.
  Span<const std::int32_t> vertices;
  std::vector<Edge> edges;  ///< soft edges that pass through faces of the part; sorted vertices
  std::vector<std::int32_t> pierced;  ///< soft faces through which edges of the part pass
  Blocking blocking;
};

/// Adds what is inside of all `sides`. `origin`: of the body that they are of. What hangs together
/// leaves through the same side: the nearest one that is not blocked. It stays if there is none, or
/// if it is pierced and the ways out would stretch it. An example is a carpet through which
/// furniture stands on the floor. What stays in an obstacle that nothing moves is trapped.
void find_in_convex(const StepTopology& topology, const Motion& motion,
                    const Candidates& candidates, const Vector3d& origin,
                    const std::vector<Side>& sides, PenetrationList& found);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
