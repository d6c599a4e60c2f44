#include "detection/convex_contacts.h"

#include <algorithm>
#include <cstdint>
#include <utility>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// With more pairs of a vertex and a part, the detector's hierarchy is faster.
constexpr std::int64_t max_pairs = 1 << 15;
// An obstacle is given up after so many motions in succession in which it was not clear.
constexpr int max_unclear_motions = 32;

}  // namespace

bool ConvexContacts::may_be_met(const ObstaclePairs& bodies) const {
  const Triangles& triangles = *topology_.bodies()[bodies.body].triangles;
  return triangles.is_convex() && !motion_.rigid_of(bodies.body).local_at_start &&
         std::all_of(triangles.convex_parts.begin(), triangles.convex_parts.end(),
                     [](const ConvexPart& part) {
                       return part.sides.size() <= MovingPolyhedron::max_sides;
                     }) &&
         std::all_of(bodies.soft_bodies.begin(), bodies.soft_bodies.end(),
                     [this](std::int32_t s) { return topology_.bodies()[s].responds; });
}

void ConvexContacts::set_topology() {
  obstacles_.clear();
  std::int64_t count = 0;
  for (ObstaclePairs& bodies : find_obstacle_pairs(topology_)) {
    if (!may_be_met(bodies)) continue;
    Obstacle obstacle;
    for (const ConvexPart& part : topology_.bodies()[bodies.body].triangles->convex_parts) {
      for (const std::int32_t s : bodies.soft_bodies) {
        obstacle.pairs.emplace_back(topology_, motion_, s, bodies.body, part);
        count += topology_.bodies()[s].vertex_count;
      }
    }
    obstacle.bodies = std::move(bodies);
    obstacles_.push_back(std::move(obstacle));
  }
  if (count > max_pairs) clear();
}

void ConvexContacts::leave_out(std::vector<Body>& filters) const {
  for (const Obstacle& obstacle : obstacles_) bullet::leave_out(obstacle.bodies, filters);
}

bool ConvexContacts::find_near(double separation, std::vector<Contact>& contacts) {
  contacts.clear();
  const auto given_up = std::remove_if(obstacles_.begin(), obstacles_.end(), [&](Obstacle& o) {
    o.unclear_motions = o.was_clear ? 0 : o.unclear_motions + 1;
    o.was_clear = true;
    return o.unclear_motions >= max_unclear_motions || !find_near(o, separation, contacts);
  });
  const bool kept_all = given_up == obstacles_.end();
  obstacles_.erase(given_up, obstacles_.end());
  std::sort(contacts.begin(), contacts.end());
  return kept_all;
}

// Returns false, without contacts, if a vertex starts in the obstacle.
bool ConvexContacts::find_near(Obstacle& obstacle, double separation,
                               std::vector<Contact>& contacts) const {
  const std::size_t first = contacts.size();
  for (ConvexPair& pair : obstacle.pairs) {
    const double thickness = surfaces_.of(pair.soft_body(), obstacle.bodies.body).thickness;
    if (pair.find_near(separation, thickness, contacts)) continue;
    contacts.resize(first);
    return false;
  }
  return true;
}

bool ConvexContacts::are_clear(bool at_start) {
  bool all_clear = true;
  for (Obstacle& obstacle : obstacles_) {
    if (std::all_of(obstacle.pairs.begin(), obstacle.pairs.end(),
                    [at_start](ConvexPair& pair) { return pair.is_clear(at_start); }))
      continue;
    if (!at_start) obstacle.was_clear = false;
    all_clear = false;
  }
  return all_clear;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
