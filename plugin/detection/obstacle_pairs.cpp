#include "detection/obstacle_pairs.h"

#include <algorithm>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

std::vector<ObstaclePairs> find_obstacle_pairs(const StepTopology& step_topology) {
  const Topology topology = step_topology.topology();
  std::vector<BodyPair> disabled(topology.disabled_pairs.begin(), topology.disabled_pairs.end());
  std::sort(disabled.begin(), disabled.end());
  std::vector<ObstaclePairs> found;
  for (std::size_t b = 0; b < topology.bodies.size(); ++b) {
    const StepTopology::BodyRecord& record = step_topology.bodies()[b];
    if (record.soft || record.has_anchored_nodes) continue;
    const auto body = static_cast<std::int32_t>(b);
    ObstaclePairs obstacle{body, {}};
    for (std::int32_t s = 0; s < body && step_topology.bodies()[s].soft; ++s) {
      if (filters_accept(topology.bodies[s], topology.bodies[b]) &&
          !std::binary_search(disabled.begin(), disabled.end(), BodyPair{s, body}))
        obstacle.soft_bodies.push_back(s);
    }
    if (!obstacle.soft_bodies.empty()) found.push_back(std::move(obstacle));
  }
  return found;
}

// The square of an edge is a convex function of time, so it is largest at one of the ends.
std::vector<double> longest_edges_squared(const StepTopology& step_topology, const Motion& motion,
                                          bool at_start) {
  const Topology topology = step_topology.topology();
  std::vector<double> longest(topology.bodies.size(), 0);
  const auto read = [&](std::int32_t a, std::int32_t b) {
    double& of_body = longest[static_cast<std::size_t>(step_topology.body_of(a))];
    of_body = std::max(of_body, (motion.start_of(a) - motion.start_of(b)).squaredNorm());
    if (!at_start) of_body = std::max(of_body, (motion.end_of(a) - motion.end_of(b)).squaredNorm());
  };
  for (const Face& face : topology.faces) {
    if (!step_topology.is_soft(face[0])) break;  // the faces of obstacles come last
    for (int k = 0; k < 3; ++k) read(face[k], face[(k + 1) % 3]);
  }
  for (const Edge& edge : topology.edges) read(edge[0], edge[1]);
  return longest;
}

void leave_out(const ObstaclePairs& obstacle, std::vector<Body>& filters) {
  filters[static_cast<std::size_t>(obstacle.body)].layer = 0;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
