#include "obstacles/obstacle_pairs.h"

#include <algorithm>
#include <cmath>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

std::vector<ObstaclePairs> find_obstacle_pairs(const StepTopology& step_topology) {
  const Topology topology = step_topology.topology();
  std::vector<BodyPair> disabled(topology.disabled_pairs.begin(), topology.disabled_pairs.end());
  std::sort(disabled.begin(), disabled.end());
  std::vector<ObstaclePairs> found;
  for (std::size_t b = 0; b < topology.bodies.size(); ++b) {
    const StepTopology::BodyRecord& record = step_topology.bodies()[b];
    if (record.soft || !record.triangles) continue;
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

namespace {

// Squared radius of the smallest circle around a triangle whose sides have these squared lengths.
// It has the longest side as its diameter, or all corners on it.
double smallest_circle(double a, double b, double c) {
  const double longest = std::max({a, b, c}), sum = a + b + c;
  if (sum <= 2 * longest) return longest / 4;
  const double area = sum * sum - 2 * (a * a + b * b + c * c);  // 16 area^2
  return std::clamp(a * b * c / area, longest / 4, longest / 3);
}

// The square of a side is a convex function of time, so it is largest at one of the ends.
double largest_square(std::int32_t a, std::int32_t b, const Motion& motion, bool at_start) {
  const double start = (motion.start_of(a) - motion.start_of(b)).squaredNorm();
  return at_start ? start : std::max(start, (motion.end_of(a) - motion.end_of(b)).squaredNorm());
}

}  // namespace

double sag_of(const Edge& edge, const Motion& motion, bool at_start) {
  return largest_square(edge[0], edge[1], motion, at_start) / 4;
}

// If all sides of a triangle grow, so does its smallest circle (Kirszbraun's theorem).
double sag_of(const Face& face, const Motion& motion, bool at_start) {
  return smallest_circle(largest_square(face[0], face[1], motion, at_start),
                         largest_square(face[1], face[2], motion, at_start),
                         largest_square(face[2], face[0], motion, at_start));
}

double largest_sag(const StepTopology& step_topology, std::int32_t soft_body, const Motion& motion,
                   bool at_start) {
  const StepTopology::BodyRecord& soft = step_topology.bodies()[soft_body];
  const Topology topology = step_topology.topology();
  double largest = 0;
  for (std::int32_t f = soft.faces.first; f < soft.faces.last; ++f)
    largest = std::max(largest, sag_of(topology.faces[f], motion, at_start));
  for (std::int32_t e = soft.edges.first; e < soft.edges.last; ++e)
    largest = std::max(largest, sag_of(topology.edges[e], motion, at_start));
  return largest;
}

double longest_edge(const StepTopology& step_topology, std::int32_t soft_body,
                    const Motion& motion) {
  const StepTopology::BodyRecord& soft = step_topology.bodies()[soft_body];
  const Topology topology = step_topology.topology();
  double longest = 0;
  const auto read_edge = [&](std::int32_t a, std::int32_t b) {
    longest = std::max(longest, largest_square(a, b, motion, false));
  };
  for (std::int32_t f = soft.faces.first; f < soft.faces.last; ++f) {
    const Face& face = topology.faces[f];
    for (int k = 0; k < 3; ++k) read_edge(face[k], face[(k + 1) % 3]);
  }
  for (std::int32_t e = soft.edges.first; e < soft.edges.last; ++e)
    read_edge(topology.edges[e][0], topology.edges[e][1]);
  return std::sqrt(longest);
}

void set_normal(const Vector3d& normal, Contact& contact) {
  for (int k = 0; k < 3; ++k) contact.normal[k] = static_cast<float>(normal[k]);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
