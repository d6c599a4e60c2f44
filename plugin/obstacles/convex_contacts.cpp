#include "obstacles/convex_contacts.h"

#include <algorithm>
#include <cstdint>
#include <utility>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// With more pairs of a vertex and a part, the detector's hierarchy is faster.
constexpr std::int64_t max_pairs = 1 << 15;
// An obstacle is given up after so many motions in succession in which it was not clear. An impact
// may last for half a second.
constexpr int max_unclear_motions = 32;

}  // namespace

// What anchors hold to an obstacle mostly starts inside of it.
bool ConvexContacts::may_be_met(const ObstaclePairs& bodies) const {
  const RigidMotion& rigid = motion_.rigid_of(bodies.body);
  return topology_.bodies()[bodies.body].triangles->is_convex() && !rigid.local_at_start &&
         rigid.anchored.empty() &&
         std::all_of(bodies.soft_bodies.begin(), bodies.soft_bodies.end(),
                     [this](std::int32_t s) { return topology_.bodies()[s].responds; });
}

void ConvexContacts::set_topology() {
  obstacles_.clear();
  std::vector<ObstaclePairs> met = find_obstacle_pairs(topology_);
  met.erase(std::remove_if(met.begin(), met.end(),
                           [this](const ObstaclePairs& bodies) { return !may_be_met(bodies); }),
            met.end());
  const auto parts_of = [this](const ObstaclePairs& bodies) -> const std::vector<ConvexPart>& {
    return topology_.bodies()[bodies.body].triangles->convex_parts;
  };
  std::int64_t count = 0;
  for (const ObstaclePairs& bodies : met) {
    for (const std::int32_t s : bodies.soft_bodies)
      count +=
          static_cast<std::int64_t>(parts_of(bodies).size()) * topology_.bodies()[s].vertex_count;
  }
  if (count > max_pairs) return;
  soft_bounds_.set_topology();
  for (ObstaclePairs& bodies : met) {
    Obstacle obstacle;
    for (const ConvexPart& part : parts_of(bodies)) {
      obstacle.parts.push_back({MovingPolyhedron(part), {}});
      for (const std::int32_t s : bodies.soft_bodies)
        obstacle.parts.back().pairs.emplace_back(topology_, motion_, s, bodies.body);
    }
    obstacle.bodies = std::move(bodies);
    obstacles_.push_back(std::move(obstacle));
  }
}

void ConvexContacts::leave_out(std::vector<Body>& filters) const {
  for (const Obstacle& obstacle : obstacles_) bullet::leave_out(obstacle.bodies, filters);
}

void ConvexContacts::begin(bool at_start) {
  at_start_ = at_start;
  soft_bounds_.begin(at_start);
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

bool ConvexContacts::find_near(double separation, std::vector<Contact>& contacts) {
  contacts.clear();
  begin(false);
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

bool ConvexContacts::are_clear(bool at_start) {
  begin(at_start);
  bool all_clear = true;
  for (Obstacle& obstacle : obstacles_) {
    if (is_clear(obstacle)) continue;
    if (!at_start) obstacle.was_clear = false;
    all_clear = false;
  }
  return all_clear;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
