// What the contacts with simple shapes need to know of an obstacle and of the soft bodies around
// it.
#pragma once

#include <cstdint>
#include <vector>

#include "motion/motion.h"
#include "scene/step_topology.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// An obstacle and the soft bodies that may meet it; indices of bodies in the topology.
struct ObstaclePairs {
  std::int32_t body;
  std::vector<std::int32_t> soft_bodies;
};

/// Returns the obstacles that at least one soft body may meet. Leaves out obstacles that nodes are
/// anchored to.
std::vector<ObstaclePairs> find_obstacle_pairs(const StepTopology& topology);

/// Squares of lengths in a motion, or at its start; square metres. Kept for its memory.
///
/// The sag of a primitive: let all its vertices be at least D away from a place. Then all its
/// points are at least sqrt(D^2 - sag) away. With L as its longest edge it is L^2 / 3, the largest
/// squared circumradius, for a face, and L^2 / 4 for an edge.
struct EdgesSquared {
  std::vector<double> of_body,  ///< L^2 of each soft body
      mean_sag_of_body,         ///< over its faces and edges
      sag_of_face,              ///< by soft face
      sag_of_edge;              ///< by index of Topology::edges
  std::vector<int> count;       ///< of faces and edges, by body
};
void measure_edges_squared(const StepTopology& topology, const Motion& motion, bool at_start,
                           EdgesSquared& squares);

/// Changes the filters of a detector, such that it leaves out the pairs of these obstacles.
void leave_out(const ObstaclePairs& obstacle, std::vector<Body>& filters);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
