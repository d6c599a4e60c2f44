#include "obstacles/simple_contacts.h"

#include <algorithm>

#include "contact/contact_checks.h"
#include "lazyccd/debug/assert.h"
#include "settings.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

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

void SimpleContacts::set_topology(const std::vector<std::int32_t>& new_index) {
  std::vector<ObstaclePairs> obstacles = find_obstacle_pairs(topology_);
  const auto index_of = [&new_index](std::int32_t old) {
    const auto body = static_cast<std::size_t>(old);
    return body < new_index.size() ? new_index[body] : -1;
  };
  // Of the new obstacle: whether it and all that meets it are those of an old one.
  const auto is_known = [&index_of](const ObstaclePairs& now, const ObstaclePairs& old) {
    if (index_of(old.body) != now.body) return false;
    std::vector<std::int32_t> met;
    for (const std::int32_t s : old.soft_bodies) met.push_back(index_of(s));
    std::sort(met.begin(), met.end());
    return std::includes(met.begin(), met.end(), now.soft_bodies.begin(), now.soft_bodies.end());
  };
  std::vector<ObstaclePairs> given_up;
  for (const ObstaclePairs& now : obstacles)
    if (std::any_of(given_up_.begin(), given_up_.end(),
                    [&](const ObstaclePairs& old) { return is_known(now, old); }))
      given_up.push_back(now);
  given_up_.swap(given_up);
  remove_if(obstacles, [this](const ObstaclePairs& o) {
    return std::any_of(given_up_.begin(), given_up_.end(),
                       [&o](const ObstaclePairs& g) { return g.body == o.body; });
  });
  remove_if(obstacles, [this](const ObstaclePairs& o) { return !may_be_met(o); });
  const auto leave_largest = [&](const auto& parts_of) {
    struct Pairs {
      std::int64_t count;
      std::size_t obstacle;
    };
    std::vector<Pairs> all;
    std::int64_t sum = 0;
    for (std::size_t i = 0; i < obstacles.size(); ++i) {
      std::int64_t vertices = 0;
      for (const std::int32_t s : obstacles[i].soft_bodies)
        vertices += topology_.bodies()[s].vertex_count;
      const auto& parts = parts_of(*topology_.bodies()[obstacles[i].body].triangles);
      all.push_back({vertices * static_cast<std::int64_t>(parts.size()), i});
      sum += all.back().count;
    }
    std::stable_sort(all.begin(), all.end(),
                     [](const Pairs& a, const Pairs& b) { return a.count > b.count; });
    for (auto largest = all.begin(); sum > settings::simple_shapes::max_pairs; ++largest) {
      sum -= largest->count;
      obstacles[largest->obstacle].soft_bodies.clear();
    }
    remove_if(obstacles, [](const ObstaclePairs& o) { return o.soft_bodies.empty(); });
  };
  leave_largest([](const Triangles& triangles) -> auto& { return triangles.round_parts; });
  leave_largest([](const Triangles& triangles) -> auto& { return triangles.convex_parts; });
  const std::vector<Obstacle> last = obstacles_;
  set_obstacles(obstacles);
  for (Obstacle& now : obstacles_) {
    const auto old = std::find_if(last.begin(), last.end(),
                                  [&](const Obstacle& o) { return is_known(now.pairs, o.pairs); });
    if (old == last.end()) continue;
    now.was_clear = old->was_clear;
    now.unclear_motions = old->unclear_motions;
  }
}

void SimpleContacts::set_obstacles(const std::vector<ObstaclePairs>& obstacles) {
  obstacles_.clear();
  for (const ObstaclePairs& o : obstacles)
    obstacles_.push_back({o, !topology_.bodies()[o.body].triangles->convex_parts.empty()});
  if (any()) soft_bounds_.set_topology();
  round_.set_obstacles(obstacles);
  convex_.set_obstacles(obstacles);
}

void SimpleContacts::give_up(std::int32_t body) {
  LAZYCCD_ASSERT(std::any_of(obstacles_.begin(), obstacles_.end(),
                             [body](const Obstacle& o) { return o.pairs.body == body; }),
                 "an obstacle that is given up was handled in closed form");
  round_.give_up(body);
  convex_.give_up(body);
  const auto obstacle = std::find_if(obstacles_.begin(), obstacles_.end(),
                                     [body](const Obstacle& o) { return o.pairs.body == body; });
  given_up_.push_back(obstacle->pairs);
  obstacles_.erase(obstacle);
}

void SimpleContacts::leave_out(std::vector<Body>& filters) const {
  for (const Obstacle& o : obstacles_) filters[static_cast<std::size_t>(o.pairs.body)].layer = 0;
}

bool SimpleContacts::find_near(double separation, std::vector<Contact>& contacts) {
  contacts.clear();
  if (!any()) return true;
  const std::size_t count = obstacles_.size();
  at_fault_.clear();
  for (Obstacle& o : obstacles_) {
    o.unclear_motions = o.was_clear ? 0 : o.unclear_motions + 1;
    o.was_clear = true;
    if (o.may_be_given_up && o.unclear_motions >= settings::simple_shapes::max_unclear_motions)
      at_fault_.push_back(o.pairs.body);
  }
  for (const std::int32_t body : at_fault_) give_up(body);
  soft_bounds_.begin(false);
  at_fault_.clear();
  convex_.find_near(separation, of_convex_, at_fault_);
  for (const std::int32_t body : at_fault_) give_up(body);
  round_.find_near(separation, contacts);
  const auto middle = contacts.insert(contacts.end(), of_convex_.begin(), of_convex_.end());
  std::inplace_merge(contacts.begin(), middle, contacts.end());
  LAZYCCD_ASSERT(are_sorted(contacts), "contacts in closed form are sorted, none twice");
  return obstacles_.size() == count;
}

bool SimpleContacts::are_clear(bool at_start) {
  if (!any()) return true;
  soft_bounds_.begin(at_start);
  at_fault_.clear();
  convex_.find_unclear(at_start, at_fault_);
  if (at_start && !at_fault_.empty()) return false;
  round_.find_unclear(at_start, at_fault_);
  if (at_start) return at_fault_.empty();
  for (Obstacle& o : obstacles_)
    o.was_clear &= std::find(at_fault_.begin(), at_fault_.end(), o.pairs.body) == at_fault_.end();
  return at_fault_.empty();
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
