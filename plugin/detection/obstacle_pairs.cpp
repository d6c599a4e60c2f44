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
void measure_edges_squared(const StepTopology& step_topology, const Motion& motion, bool at_start,
                           EdgesSquared& squares) {
  const Topology topology = step_topology.topology();
  squares.of_body.assign(topology.bodies.size(), 0);
  squares.mean_sag_of_body.assign(topology.bodies.size(), 0);
  squares.count.assign(topology.bodies.size(), 0);
  squares.sag_of_face.clear();
  squares.sag_of_edge.clear();
  const auto square = [&](std::int32_t a, std::int32_t b) {
    const double start = (motion.start_of(a) - motion.start_of(b)).squaredNorm();
    return at_start ? start : std::max(start, (motion.end_of(a) - motion.end_of(b)).squaredNorm());
  };
  const auto sag_of = [&](std::int32_t vertex, double longest, double divisor) {
    const std::int32_t body = step_topology.body_of(vertex);
    squares.of_body[body] = std::max(squares.of_body[body], longest);
    squares.mean_sag_of_body[body] += longest / divisor;
    ++squares.count[body];
    return longest / divisor;
  };
  for (const Face& f : topology.faces) {
    if (!step_topology.is_soft(f[0])) break;  // the faces of obstacles come last
    const double longest = std::max({square(f[0], f[1]), square(f[1], f[2]), square(f[2], f[0])});
    squares.sag_of_face.push_back(sag_of(f[0], longest, 3));
  }
  for (const Edge& edge : topology.edges)
    squares.sag_of_edge.push_back(sag_of(edge[0], square(edge[0], edge[1]), 4));
  for (std::size_t body = 0; body < squares.count.size(); ++body)
    squares.mean_sag_of_body[body] /= std::max(1, squares.count[body]);
}

void leave_out(const ObstaclePairs& obstacle, std::vector<Body>& filters) {
  filters[static_cast<std::size_t>(obstacle.body)].layer = 0;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
