#include "response/islands.h"

#include <algorithm>
#include <map>

#include "util/disjoint_sets.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Eigen::Vector3d;

// Speed of a vertex of infinite mass, m/s; `body` is its rigid body or null. Bullet moves kinematic
// bodies once per frame, in the first of its substeps, and stores their velocity. The speed is at
// most the stored one. If that is zero, the body was put elsewhere, and the displacement counts.
double prescribed_speed_of(std::int32_t v, const RigidMotion* body, const Motion& motion) {
  const double speed = (motion.end_of(v) - motion.start_of(v)).norm() / motion.dt;
  if (!body || (body->velocity.isZero(0) && body->angular_velocity.isZero(0))) return speed;
  const Vector3d arm = motion.start_of(v) - body->centre();
  return std::min(speed, (body->velocity + body->angular_velocity.cross(arm)).norm());
}

}  // namespace

std::vector<Island> find_islands(const std::vector<const ContactRow*>& rows,
                                 const std::vector<std::int32_t>& others, const Motion& motion) {
  DisjointSets sets(motion.rigid_of_body.size());
  std::vector<char> in_contact(sets.size(), 0);
  for (const std::int32_t body : others) in_contact[body] = 1;
  for (const ContactRow* const row : rows) {
    in_contact[row->contact.body_a] = in_contact[row->contact.body_b] = 1;
    sets.join(row->contact.body_a, row->contact.body_b);
  }
  std::set<std::int32_t> carriers;
  // Contacts of an anchored vertex also push the rigid body that it is anchored to.
  for (const auto& [vertex, anchored] : motion.anchored) {
    const auto next =
        std::upper_bound(motion.first_vertex.begin(), motion.first_vertex.end(), vertex);
    const auto body = static_cast<std::int32_t>(next - motion.first_vertex.begin()) - 1;
    if (!in_contact[body]) continue;
    const auto anchor_body =
        std::find(motion.rigid_of_body.begin(), motion.rigid_of_body.end(), anchored.rigid);
    const auto rigid_body = static_cast<std::int32_t>(anchor_body - motion.rigid_of_body.begin());
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
    if (rigid >= 0 && motion.rigid[rigid].is_dynamic()) {
      island.free = island.free && !motion.rigid[rigid].is_locked();
      continue;
    }
    if (rigid >= 0 && motion.rigid[rigid].articulated >= 0) {
      island.free = false;
      island.articulated.insert(motion.rigid[rigid].articulated);
      continue;
    }
    for (std::int32_t v = motion.first_vertex[body]; v < motion.first_vertex[body + 1]; ++v) {
      if (motion.is_free(v) || (motion.is_soft(v) && motion.anchor_body_of(v) >= 0)) continue;
      island.free = false;
      const RigidMotion* const obstacle = rigid >= 0 ? &motion.rigid[rigid] : nullptr;
      island.prescribed_speed =
          std::max(island.prescribed_speed, prescribed_speed_of(v, obstacle, motion));
    }
  }
  std::vector<Island> result;
  for (const auto& island : islands) result.push_back(island.second);
  return result;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
