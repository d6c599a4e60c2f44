#include "response/impact_zones.h"

#include <algorithm>

#include "motion/rotation.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Largest rotation of a zone in one step, radians. With more, the linear path of a node would leave
// the circle too far.
constexpr double max_rotation = 1;

// Rotation vector of a body from its start to its predicted pose, turned further by
// `response_rotation`.
Vector3d rotation_over_step(const RigidMotion& body, const Vector3d& response_rotation) {
  const Matrix3d whole = rotation_by(response_rotation) * to_eigen(body.predicted.getBasis()) *
                         to_eigen(body.start.getBasis()).transpose();
  return rotation_vector(whole);
}

// Whether a vertex is pinned. For an anchored vertex the zones contain the rigid body instead.
bool is_pinned(std::int32_t v, const Motion& motion) {
  return motion.is_soft(v) && motion.inverse_mass[v] == 0 && motion.anchor_body_of(v) < 0;
}

// Whether the contact is between a moving kinematic body and a pinned node that moves in another
// way. Applications have such pairs.
bool has_conflicting_motion(const Contact& contact, const Motion& motion) {
  const int a = motion.rigid_of_body[contact.body_a], b = motion.rigid_of_body[contact.body_b];
  if (a < 0 && b < 0) return false;
  const RigidMotion& body = motion.rigid[a >= 0 ? a : b];
  if (body.is_movable() || body.start == body.end) return false;
  const RigidStep step = step_of(body);
  return std::any_of(contact.vertices.begin(), contact.vertices.end(), [&](std::int32_t v) {
    return is_pinned(v, motion) && motion.end_of(v) == motion.predicted[v] &&
           !step.moves_along(v, motion);
  });
}

// Sums of mass and of mass times position and displacement.
struct MassSum {
  double mass = 0;
  Vector3d centre = Vector3d::Zero(), translation = Vector3d::Zero();

  void add(double m, const Vector3d& at, const Vector3d& moved) {
    mass += m;
    centre += m * at;
    translation += m * moved;
  }
};

}  // namespace

bool ImpactZones::PrescribedMembers::include(const PrescribedMembers& other) const {
  return std::includes(nodes.begin(), nodes.end(), other.nodes.begin(), other.nodes.end()) &&
         std::includes(bodies.begin(), bodies.end(), other.bodies.begin(), other.bodies.end());
}

void ImpactZones::PrescribedMembers::add(const PrescribedMembers& other) {
  nodes.insert(other.nodes.begin(), other.nodes.end());
  bodies.insert(other.bodies.begin(), other.bodies.end());
}

ImpactZones::ImpactZones(const Motion& motion)
    : zones_(motion.inverse_mass.size() + motion.rigid.size()),
      held_(zones_.size(), 0),
      zone_vertex_(motion.rigid.size(), in_no_zone),
      solved_(motion.solved),
      rigid_(motion.rigid) {}

std::int64_t ImpactZones::node_count() {
  std::vector<char> in_zone(zones_.size(), 0);
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(zones_.size()); ++i) {
    if (zones_.find(i) != i) in_zone[i] = in_zone[zones_.find(i)] = 1;
  }
  for (const auto& entry : prescribed_members_) in_zone[entry.first] = 1;
  return std::count(in_zone.begin(), in_zone.begin() + solved_.size(), 1);
}

std::int64_t ImpactZones::held_count() const { return std::count(held_.begin(), held_.end(), 1); }

std::vector<std::int32_t> ImpactZones::members_of(const Contact& contact, const Motion& motion) {
  std::vector<std::int32_t> members;
  for (const std::int32_t b : {contact.body_a, contact.body_b}) {
    const int body = motion.rigid_of_body[b];
    if (body >= 0 && motion.rigid[body].is_dynamic()) members.push_back(motion.soft_count() + body);
  }
  for (const std::int32_t v : contact.vertices) {
    if (motion.is_free(v)) {
      members.push_back(v);
    } else if (motion.is_soft(v)) {
      const int anchor = motion.anchor_body_of(v);
      if (anchor >= 0 && motion.rigid[anchor].is_dynamic())
        members.push_back(motion.soft_count() + anchor);
    }
  }
  return members;
}

ImpactZones::PrescribedMembers ImpactZones::prescribed_members_of(const Contact& contact,
                                                                  const Motion& motion) {
  PrescribedMembers prescribed;
  for (const std::int32_t b : {contact.body_a, contact.body_b}) {
    const int body = motion.rigid_of_body[b];
    if (body >= 0 && !motion.rigid[body].is_dynamic()) prescribed.bodies.insert(body);
  }
  // The free members follow the body and leave the pinned node behind.
  if (has_conflicting_motion(contact, motion)) return prescribed;
  for (const std::int32_t v : contact.vertices) {
    if (is_pinned(v, motion)) prescribed.nodes.insert(v);
    const int anchor = motion.is_soft(v) ? motion.anchor_body_of(v) : -1;
    if (anchor >= 0 && !motion.rigid[anchor].is_dynamic()) prescribed.bodies.insert(anchor);
  }
  return prescribed;
}

bool ImpactZones::note_vertices(const Contact& contact, const Motion& motion) {
  bool changed = false;
  const auto note = [&](int body, std::int32_t vertex) {
    if (body < 0 || !motion.rigid[body].is_dynamic()) return;
    std::int32_t& known = zone_vertex_[body];
    const std::int32_t now = known == in_no_zone || known == vertex ? vertex : turns;
    changed = changed || known != now;
    known = now;
  };
  for (const std::int32_t b : {contact.body_a, contact.body_b})
    note(motion.rigid_of_body[b], turns);
  for (const std::int32_t v : contact.vertices) {
    if (motion.is_soft(v)) note(motion.anchor_body_of(v), v);
  }
  return changed;
}

Vector3d ImpactZones::start_of_body(int body, const Motion& motion) const {
  return turns_with_zone(body) ? rigid_[body].centre() : motion.start_of(zone_vertex_[body]);
}

Vector3d ImpactZones::end_of_body(int body, const Motion& motion) const {
  const RigidMotion& moved = rigid_[body];
  const Vector3d centre = to_eigen(moved.predicted.getOrigin()) + moved.translation;
  if (turns_with_zone(body)) return centre;
  const btVector3& local = motion.anchored.at(zone_vertex_[body]).local;
  return centre + rotation_by(moved.rotation) * to_eigen(moved.predicted.getBasis() * local);
}

bool ImpactZones::is_merged(const Contact& contact, const Motion& motion) {
  const std::vector<std::int32_t> members = members_of(contact, motion);
  if (members.empty()) return true;
  for (const std::int32_t member : members) {
    if (zones_.find(member) != zones_.find(members[0])) return false;
  }
  const PrescribedMembers prescribed = prescribed_members_of(contact, motion);
  if (prescribed.empty()) return true;
  const auto all = prescribed_members_.find(zones_.find(members[0]));
  return all != prescribed_members_.end() && all->second.include(prescribed);
}

bool ImpactZones::merge(const Contact& contact, const Motion& motion) {
  const bool noted = note_vertices(contact, motion);
  if (is_merged(contact, motion)) return noted;
  const std::vector<std::int32_t> members = members_of(contact, motion);
  for (const std::int32_t member : members) zones_.join(members[0], member);
  const PrescribedMembers prescribed = prescribed_members_of(contact, motion);
  if (!prescribed.empty()) prescribed_members_[zones_.find(members[0])].add(prescribed);
  return true;
}

bool ImpactZones::absorb(const std::vector<Contact>& contacts, Motion& motion) {
  bool changed = false;
  for (const Contact& contact : contacts) changed = merge(contact, motion) || changed;
  move_all(motion);
  return changed;
}

bool ImpactZones::hold(const std::vector<Contact>& contacts, bool whole_bodies, Motion& motion) {
  bool changed = false;
  for (const Contact& contact : contacts) {
    changed = merge(contact, motion) || changed;
    std::vector<std::int32_t> held = members_of(contact, motion);
    if (whole_bodies) {
      for (const std::int32_t body : {contact.body_a, contact.body_b}) {
        for (std::int32_t v = motion.first_vertex[body]; v < motion.first_vertex[body + 1]; ++v) {
          if (motion.is_soft(v) && motion.inverse_mass[v] > 0) held.push_back(v);
        }
      }
    }
    for (const std::int32_t member : held) {
      changed = zones_.join(held[0], member) || changed;
      changed = changed || !held_[member];
      held_[member] = 1;
    }
  }
  move_all(motion);
  return changed;
}

bool ImpactZones::is_unresolvable(const Contact& contact, const Motion& motion) {
  return has_conflicting_motion(contact, motion) && is_merged(contact, motion);
}

bool ImpactZones::stop_prescribed(const std::vector<Contact>& contacts, Motion& motion) {
  bool changed = false;
  const auto hold_member = [&](std::int32_t member) {
    changed = changed || !held_[member];
    held_[member] = 1;
  };
  const auto stop = [&](const PrescribedMembers& prescribed) {
    for (const std::int32_t v : prescribed.nodes) {
      hold_member(v);
      motion.set_end_to_start(v);
    }
    for (const int body : prescribed.bodies) {
      if (motion.rigid[body].start == motion.rigid[body].end) continue;
      hold_member(motion.soft_count() + body);
      const int articulated = motion.rigid[body].articulated;
      if (articulated >= 0) {
        motion.hold_at_start(motion.articulated[articulated]);
      } else {
        motion.set_end_pose(motion.rigid[body], motion.rigid[body].start);
      }
    }
  };
  for (const Contact& contact : contacts) {
    stop(prescribed_members_of(contact, motion));
    for (const std::int32_t member : members_of(contact, motion)) {
      const auto entry = prescribed_members_.find(zones_.find(member));
      if (entry != prescribed_members_.end()) stop(entry->second);
    }
  }
  move_all(motion);
  return changed;
}

void ImpactZones::move_all(Motion& motion) {
  std::map<std::int32_t, PrescribedMembers> prescribed;
  for (const auto& entry : prescribed_members_)
    prescribed[zones_.find(entry.first)].add(entry.second);
  prescribed_members_ = std::move(prescribed);
  std::map<std::int32_t, Zone> zones;
  for (const auto& entry : prescribed_members_) zones[entry.first];
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(zones_.size()); ++i) {
    if (zones_.find(i) != i) zones[zones_.find(i)];
  }
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(zones_.size()); ++i) {
    const auto at = zones.find(zones_.find(i));
    if (at == zones.end()) continue;
    if (i < motion.soft_count()) {
      at->second.nodes.push_back(i);
    } else {
      at->second.bodies.push_back(i - motion.soft_count());
    }
    at->second.held = at->second.held || held_[i];
  }
  for (const auto& zone : zones) {
    const auto entry = prescribed_members_.find(zone.first);
    move(zone.second, entry == prescribed_members_.end() ? PrescribedMembers() : entry->second,
         motion);
  }
}

std::optional<RigidStep> ImpactZones::prescribed_step_of(const PrescribedMembers& members,
                                                         const Motion& motion) {
  std::optional<RigidStep> prescribed;
  bool is_consistent = true;
  const auto follow = [&](const RigidStep& step) {
    is_consistent = is_consistent && (!prescribed || step == *prescribed);
    prescribed = step;
  };
  for (const int body : members.bodies) follow(step_of(motion.rigid[body]));
  for (const std::int32_t v : members.nodes) {
    if (prescribed && prescribed->moves_along(v, motion)) continue;
    RigidStep step;
    step.translation = motion.end_of(v) - motion.start_of(v);
    follow(step);
  }
  return is_consistent ? prescribed : RigidStep();
}

RigidStep ImpactZones::free_step_of(const Zone& zone, const Motion& motion) const {
  RigidStep free;
  MassSum sum;
  for (const std::int32_t v : zone.nodes) {
    const Vector3d start = motion.start_of(v);
    sum.add(1 / motion.inverse_mass[v], start, solved_[v] - start);
  }
  for (const int b : zone.bodies) {
    const Vector3d at = start_of_body(b, motion);
    sum.add(rigid_[b].mass(), at, end_of_body(b, motion) - at);
  }
  if (sum.mass > 0) {
    free.centre = sum.centre / sum.mass;
    free.translation = sum.translation / sum.mass;
  } else if (!zone.bodies.empty()) {
    free.centre = start_of_body(zone.bodies.front(), motion);
  }
  Matrix3d inertia = Matrix3d::Zero();
  Vector3d momentum = Vector3d::Zero();
  const auto add = [&](double m, const Vector3d& at, const Vector3d& moved) {
    const Vector3d arm = at - free.centre;
    add_inertia(m, arm, inertia);
    momentum += m * arm.cross(moved);
  };
  for (const std::int32_t v : zone.nodes) {
    const Vector3d start = motion.start_of(v);
    add(1 / motion.inverse_mass[v], start, solved_[v] - start);
  }
  for (const int b : zone.bodies) {
    const RigidMotion& body = rigid_[b];
    const Vector3d at = start_of_body(b, motion);
    add(body.mass(), at, end_of_body(b, motion) - at);
    if (!turns_with_zone(b)) continue;
    const Matrix3d body_inertia = body.inertia();
    inertia += body_inertia;
    momentum += body_inertia * rotation_over_step(body, body.rotation);
  }
  Vector3d rotation = rotation_from_momentum(inertia, momentum);
  if (rotation.norm() > max_rotation) rotation *= max_rotation / rotation.norm();
  for (const int b : zone.bodies) {
    if (!rigid_[b].is_locked()) continue;
    free.translation = (rigid_[b].inverse_mass.array() > 0).select(free.translation, 0);
    rotation.setZero();
  }
  free.rotation = rotation_by(rotation);
  return free;
}

void ImpactZones::move(const Zone& zone, const PrescribedMembers& members, Motion& motion) const {
  const std::optional<RigidStep> prescribed = prescribed_step_of(members, motion);
  const RigidStep velocity_step = prescribed ? *prescribed : free_step_of(zone, motion);
  const RigidStep position_step = zone.held && !prescribed ? RigidStep() : velocity_step;

  for (const std::int32_t v : zone.nodes) {
    const Vector3d start = motion.start_of(v);
    motion.solved[v] = velocity_step(start);
    if (position_step.stays()) {
      motion.set_end_to_start(v);
    } else {
      motion.split_displacement[v].setZero();
      motion.round_end(v);
    }
  }
  for (const int b : zone.bodies) {
    RigidMotion& body = motion.rigid[b];
    const Vector3d at = start_of_body(b, motion);
    if (turns_with_zone(b)) {
      const Matrix3d inverse_predicted =
          (to_eigen(body.predicted.getBasis()) * to_eigen(body.start.getBasis()).transpose())
              .transpose();
      body.rotation = rotation_vector(velocity_step.rotation * inverse_predicted);
    } else {
      body.rotation = rigid_[b].rotation;
    }
    body.translation = velocity_step(at) - (end_of_body(b, motion) - rigid_[b].translation);
    body.split_translation = position_step(at) - velocity_step(at);
    body.split_rotation.setZero();
    if (position_step.stays()) {
      motion.set_end_to_start(body);
    } else {
      motion.apply_response(body);
    }
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
