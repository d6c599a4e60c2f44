#include "response/islands.h"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "util/disjoint_sets.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Speed of a vertex of infinite mass, m/s; `body` is its rigid body or null. Of a conveyor it is
// the speed that Bullet stores. Any other body may make up for a lag, or move by a frame's motion
// in one substep, so it is at most that speed. If that is zero, the body was put elsewhere, and the
// displacement counts.
double prescribed_speed_of(std::int32_t v, const RigidMotion* body, const Motion& motion) {
  const double speed = (motion.end_of(v) - motion.start_of(v)).norm() / motion.dt;
  if (!body || (body->velocity.isZero() && body->angular_velocity.isZero())) return speed;
  const double stored_speed = body->velocity_at(motion.start_of(v)).norm();
  return body->is_conveyor ? stored_speed : std::min(speed, stored_speed);
}

// Speed of the fastest vertex of a body that is of infinite mass or that the application moves,
// m/s; none if it has no such vertex.
std::optional<double> prescribed_speed_of(std::int32_t body, const Motion& motion) {
  const int rigid = motion.rigid_of_body[body];
  const bool has_velocity = rigid >= 0 && !motion.rigid[rigid].is_driven;
  const RigidMotion* const obstacle = has_velocity ? &motion.rigid[rigid] : nullptr;
  std::optional<double> fastest;
  for (std::int32_t v = motion.first_vertex[body]; v < motion.first_vertex[body + 1]; ++v) {
    if (motion.is_free(v) || (motion.is_soft(v) && motion.anchor_body_of(v) >= 0)) continue;
    fastest = std::max(fastest.value_or(0), prescribed_speed_of(v, obstacle, motion));
  }
  return fastest;
}

}  // namespace

void Island::add_fixed(std::optional<double> speed) {
  if (!speed) return;
  free = false;
  prescribed_speed = std::max(prescribed_speed, *speed);
}

std::vector<Island> find_islands(const std::vector<const ContactRow*>& rows,
                                 const std::vector<std::int32_t>& others, const Motion& motion) {
  DisjointSets sets(motion.rigid_of_body.size());
  std::vector<char> in_contact(sets.size(), 0);
  for (const std::int32_t body : others) in_contact[body] = 1;
  const auto is_movable = [&motion](std::int32_t body) {
    const int rigid = motion.rigid_of_body[body];
    return rigid < 0 || motion.rigid[rigid].is_movable();
  };
  for (const ContactRow* const row : rows) {
    const std::int32_t a = row->contact.body_a, b = row->contact.body_b;
    for (const std::int32_t body : {a, b})
      if (is_movable(body)) in_contact[body] = 1;
    if (is_movable(a) && is_movable(b)) sets.join(a, b);
  }
  std::vector<std::int32_t> body_of_rigid(motion.rigid.size());
  for (std::size_t body = 0; body < motion.rigid_of_body.size(); ++body) {
    const int rigid = motion.rigid_of_body[body];
    if (rigid >= 0) body_of_rigid[rigid] = static_cast<std::int32_t>(body);
  }
  std::set<std::int32_t> carriers;
  // Contacts of an anchored vertex also push the rigid body that it is anchored to.
  for (const auto& [vertex, anchored] : motion.anchored) {
    const auto next =
        std::upper_bound(motion.first_vertex.begin(), motion.first_vertex.end(), vertex);
    const auto body = static_cast<std::int32_t>(next - motion.first_vertex.begin()) - 1;
    if (!in_contact[body]) continue;
    const std::int32_t rigid_body = body_of_rigid[anchored.rigid];
    if (!in_contact[rigid_body]) carriers.insert(rigid_body);
    sets.join(body, rigid_body);
  }
  for (const std::int32_t body : carriers) in_contact[body] = 1;
  std::map<std::int32_t, Island> islands;
  for (std::int32_t body = 0; body < static_cast<std::int32_t>(sets.size()); ++body) {
    if (!in_contact[body]) continue;
    Island& island = islands[sets.find(body)];
    island.bodies.push_back(body);
    if (carriers.count(body) > 0) island.carriers.insert(body);
    const int rigid = motion.rigid_of_body[body];
    if (rigid >= 0 && motion.rigid[rigid].is_driven)
      island.add_fixed(prescribed_speed_of(body, motion));
    if (rigid >= 0 && motion.rigid[rigid].is_dynamic()) {
      island.free = island.free && !motion.rigid[rigid].is_locked() &&
                    !motion.rigid[rigid].supported_mobility;
      continue;
    }
    if (rigid >= 0 && motion.rigid[rigid].articulated >= 0) {
      island.free = false;
      island.articulated.insert(motion.rigid[rigid].articulated);
      continue;
    }
    island.add_fixed(prescribed_speed_of(body, motion));
  }
  // Static and kinematic bodies connect nothing, but they are a part of each island that they meet.
  std::map<std::int32_t, std::optional<double>> speed_of_fixed;
  for (const ContactRow* const row : rows) {
    std::int32_t fixed = row->contact.body_a, other = row->contact.body_b;
    if (is_movable(fixed)) std::swap(fixed, other);
    if (is_movable(fixed) || !is_movable(other)) continue;
    const auto [speed, is_new] = speed_of_fixed.try_emplace(fixed);
    if (is_new) speed->second = prescribed_speed_of(fixed, motion);
    islands[sets.find(other)].add_fixed(speed->second);
  }
  std::vector<Island> result;
  for (const auto& island : islands) result.push_back(island.second);
  return result;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
