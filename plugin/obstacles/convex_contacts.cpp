#include "obstacles/convex_contacts.h"

#include <algorithm>
#include <cstdint>
#include <utility>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

// What anchors hold to an obstacle mostly starts inside of it.
bool ConvexContacts::may_be_met(const ObstaclePairs& obstacle) const {
  return topology_.bodies()[obstacle.body].triangles->convex_parts.empty() ||
         motion_.rigid_of(obstacle.body).anchored.empty();
}

void ConvexContacts::set_obstacles(const std::vector<ObstaclePairs>& obstacles) {
  obstacles_.clear();
  for (const ObstaclePairs& bodies : obstacles) {
    Obstacle obstacle;
    obstacle.bodies = bodies;
    for (const ConvexPart& part : topology_.bodies()[bodies.body].triangles->convex_parts) {
      obstacle.parts.push_back({MovingPolyhedron(part), {}});
      for (const std::int32_t s : bodies.soft_bodies)
        obstacle.parts.back().pairs.emplace_back(topology_, motion_, s, bodies.body);
    }
    if (!obstacle.parts.empty()) obstacles_.push_back(std::move(obstacle));
  }
}

template <class Visit>
bool ConvexContacts::all_near(Obstacle& obstacle, double distance, const Visit& visit) {
  const RigidMotion& rigid = motion_.rigid_of(obstacle.bodies.body);
  for (Part& part : obstacle.parts) {
    const ConvexPart& shape = part.polyhedron.part();
    const MotionBounds bounds(motion_, rigid.first_vertex + shape.first_vertex,
                              rigid.first_vertex + shape.vertex_end, at_start_);
    bool has_moved = false;
    for (ConvexPair& pair : part.pairs) {
      const NearPrimitives& near = soft_bounds_.find_near(pair.soft_body(), bounds, distance);
      if (near.empty()) continue;
      if (!has_moved) part.polyhedron.move(rigid, motion_, at_start_);
      has_moved = true;
      if (!visit(pair, part.polyhedron, near)) return false;
    }
  }
  return true;
}

void ConvexContacts::give_up(std::int32_t body) {
  obstacles_.erase(std::remove_if(obstacles_.begin(), obstacles_.end(),
                                  [body](const Obstacle& o) { return o.bodies.body == body; }),
                   obstacles_.end());
}

void ConvexContacts::find_near(double separation, std::vector<Contact>& contacts,
                               std::vector<std::int32_t>& entered) {
  contacts.clear();
  at_start_ = false;
  for (Obstacle& obstacle : obstacles_)
    if (!find_near(obstacle, separation, contacts)) entered.push_back(obstacle.bodies.body);
  if (!std::is_sorted(contacts.begin(), contacts.end()))
    std::sort(contacts.begin(), contacts.end());
}

// Returns false, without contacts, if a vertex starts in the obstacle.
bool ConvexContacts::find_near(Obstacle& obstacle, double separation,
                               std::vector<Contact>& contacts) {
  const std::size_t first = contacts.size();
  const bool all_outside = all_near(
      obstacle, separation,
      [&](ConvexPair& pair, const MovingPolyhedron& part, const NearPrimitives& near) {
        const double thickness = surfaces_.of(pair.soft_body(), obstacle.bodies.body).thickness;
        return pair.find_near(part, near, separation, thickness, contacts);
      });
  if (!all_outside) contacts.resize(first);
  return all_outside;
}

bool ConvexContacts::is_clear(Obstacle& obstacle) {
  return all_near(
      obstacle, 0,
      [this](ConvexPair& pair, const MovingPolyhedron& part, const NearPrimitives& near) {
        return pair.is_clear(part, near, at_start_);
      });
}

void ConvexContacts::find_unclear(bool at_start, std::vector<std::int32_t>& unclear) {
  at_start_ = at_start;
  for (Obstacle& obstacle : obstacles_)
    if (!is_clear(obstacle)) unclear.push_back(obstacle.bodies.body);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
