// What the contacts with simple shapes need to know of an obstacle and of the soft bodies around
// it.
#pragma once

#include <cstdint>
#include <vector>

#include "lazyccd/contact.h"
#include "motion/motion.h"
#include "scene/step_topology.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// An obstacle and the soft bodies that may meet it; indices of bodies in the topology.
struct ObstaclePairs {
  std::int32_t body;
  std::vector<std::int32_t> soft_bodies;
};

/// Returns the obstacles with triangles that at least one soft body may meet.
std::vector<ObstaclePairs> find_obstacle_pairs(const StepTopology& topology);

/// The sag of an edge or a face in a motion, or at its start: the squared radius of the smallest
/// ball around it, m^2. With all vertices at least D away from a place, all its points are at least
/// sqrt(D^2 - sag) away. None of its points is farther than sqrt(sag) from its nearest vertex.
double sag_of(const Edge& edge, const Motion& motion, bool at_start);
double sag_of(const Face& face, const Motion& motion, bool at_start);

/// The largest sag of the edges and faces of a soft body, m^2.
double largest_sag(const StepTopology& topology, std::int32_t soft_body, const Motion& motion,
                   bool at_start);

/// The longest edge of a soft body in a motion, metres.
double longest_edge(const StepTopology& topology, std::int32_t soft_body, const Motion& motion);

void set_normal(const Vector3d& normal, Contact& contact);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
