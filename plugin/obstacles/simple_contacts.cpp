#include "obstacles/simple_contacts.h"

#include <algorithm>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// With more pairs of a vertex and a part of one kind, the detector's hierarchy is faster.
constexpr std::int64_t max_pairs = 1 << 15;

template <class Condition>
void remove_if(std::vector<ObstaclePairs>& obstacles, const Condition& condition) {
  obstacles.erase(std::remove_if(obstacles.begin(), obstacles.end(), condition), obstacles.end());
}

}  // namespace

SimpleContacts::SimpleContacts(const StepTopology& topology, const Motion& motion,
                               const PairSurfaces& surfaces, const ContactFilter& filter)
    : topology_(topology),
      motion_(motion),
      soft_bounds_(topology, motion),
      round_(topology, motion, surfaces, filter, soft_bounds_),
      convex_(topology, motion, surfaces, soft_bounds_) {}

bool SimpleContacts::may_be_met(const ObstaclePairs& obstacle) const {
  const Triangles& triangles = *topology_.bodies()[obstacle.body].triangles;
  return triangles.is_simple() && !motion_.rigid_of(obstacle.body).local_at_start &&
         std::all_of(obstacle.soft_bodies.begin(), obstacle.soft_bodies.end(),
                     [this](std::int32_t s) { return topology_.bodies()[s].responds; }) &&
         round_.may_be_met(obstacle) && convex_.may_be_met(obstacle);
}

void SimpleContacts::set_topology() {
  std::vector<ObstaclePairs> obstacles = find_obstacle_pairs(topology_);
  remove_if(obstacles, [this](const ObstaclePairs& o) { return !may_be_met(o); });
  const auto leave_if_too_many = [&](const auto& parts_of) {
    const auto count = [&](const ObstaclePairs& o) {
      return static_cast<std::int64_t>(parts_of(*topology_.bodies()[o.body].triangles).size());
    };
    std::int64_t pairs = 0;
    for (const ObstaclePairs& o : obstacles)
      for (const std::int32_t s : o.soft_bodies)
        pairs += count(o) * topology_.bodies()[s].vertex_count;
    if (pairs > max_pairs) remove_if(obstacles, [&](const auto& o) { return count(o) > 0; });
  };
  leave_if_too_many([](const Triangles& triangles) -> auto& { return triangles.round_parts; });
  leave_if_too_many([](const Triangles& triangles) -> auto& { return triangles.convex_parts; });
  set_obstacles(obstacles);
}

void SimpleContacts::set_obstacles(const std::vector<ObstaclePairs>& obstacles) {
  bodies_.clear();
  for (const ObstaclePairs& o : obstacles) bodies_.push_back(o.body);
  if (any()) soft_bounds_.set_topology();
  round_.set_obstacles(obstacles);
  convex_.set_obstacles(obstacles);
}

void SimpleContacts::leave_out(std::vector<Body>& filters) const {
  for (const std::int32_t body : bodies_) filters[static_cast<std::size_t>(body)].layer = 0;
}

bool SimpleContacts::find_near(double separation, std::vector<Contact>& contacts) {
  contacts.clear();
  if (!any()) return true;
  soft_bounds_.begin(false);
  convex_.find_near(separation, of_convex_, given_up_);
  for (const std::int32_t body : given_up_) {
    round_.give_up(body);
    bodies_.erase(std::find(bodies_.begin(), bodies_.end(), body));
  }
  round_.find_near(separation, contacts);
  const auto middle = contacts.insert(contacts.end(), of_convex_.begin(), of_convex_.end());
  std::inplace_merge(contacts.begin(), middle, contacts.end());
  return given_up_.empty();
}

bool SimpleContacts::are_clear(bool at_start) {
  if (!any()) return true;
  soft_bounds_.begin(at_start);
  return convex_.are_clear(at_start) && round_.are_clear(at_start);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
