#include "response/impact_zones.h"

#include <algorithm>
#include <numeric>

#include "motion/rotation.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Turning further than this in one step is cut short, radians: the linear path of a node would
// leave the circle too far.
constexpr double largest_turn = 1;

// x -> rotation (x - centre) + centre + shift
struct RigidStep {
  Vector3d centre = Vector3d::Zero(), translation = Vector3d::Zero();
  Matrix3d rotation = Matrix3d::Identity();

  Vector3d operator()(const Vector3d& x) const { return rotation * (x - centre) + centre + translation; }
  bool stays() const { return translation.isZero(0) && rotation.isIdentity(0); }
  // Within what rounding makes of it.
  bool has_anchored_nodes(std::int32_t soft_vertex, const Motion& motion) const {
    const Vector3d start = motion.start_of(soft_vertex), end = motion.end_of(soft_vertex);
    return ((*this)(start)-end).norm() <= 1e-3 * (end - start).norm();
  }
};

RigidStep step_of(const RigidMotion& body) {
  if (body.start == body.end) return {};
  RigidStep step;
  step.centre = body.centre();
  step.translation = to_eigen(body.end.getOrigin()) - step.centre;
  step.rotation = to_eigen(body.end.getBasis()) * to_eigen(body.start.getBasis()).transpose();
  return step;
}

Vector3d turn_over_step(const RigidMotion& body, const Vector3d& response_turn) {
  const Matrix3d whole = rotation_by(response_turn) * to_eigen(body.predicted.getBasis()) *
                         to_eigen(body.start.getBasis()).transpose();
  return rotation_vector(whole);
}

// To the last bit, and with the velocity of the solved motion.
void stay(std::int32_t soft_vertex, Motion& motion) {
  motion.split_displacement[soft_vertex] = motion.start_of(soft_vertex) - motion.solved[soft_vertex];
  const auto first = 3 * static_cast<std::ptrdiff_t>(soft_vertex);
  std::copy_n(motion.start.begin() + first, 3, motion.end.begin() + first);
}

// What carries it is a member of zones in its place.
bool is_pinned(std::int32_t v, const Motion& motion) {
  return motion.is_soft(v) && motion.inverse_mass[v] == 0 && motion.anchor_body_of(v) < 0;
}

// Between a kinematic body that moves and a pinned node that goes another way, as applications
// have both.
bool is_prescribed(const Contact& contact, const Motion& motion) {
  const int a = motion.rigid_of_body[contact.body_a], b = motion.rigid_of_body[contact.body_b];
  if (a < 0 && b < 0) return false;
  const RigidMotion& body = motion.rigid[a >= 0 ? a : b];
  if (body.is_dynamic() || body.start == body.end) return false;
  const RigidStep step = step_of(body);
  return std::any_of(contact.vertices.begin(), contact.vertices.end(), [&](std::int32_t v) {
    return is_pinned(v, motion) && motion.end_of(v) == motion.predicted[v] &&
           !step.has_anchored_nodes(v, motion);
  });
}

// Mass and moments of what moves together.
struct Matter {
  double mass = 0;
  Vector3d centre = Vector3d::Zero(), translation = Vector3d::Zero();

  void add(double m, const Vector3d& at, const Vector3d& moved) {
    mass += m;
    centre += m * at;
    translation += m * moved;
  }
};

}  // namespace

bool ImpactZones::FixedMembers::include(const FixedMembers& other) const {
  return std::includes(nodes.begin(), nodes.end(), other.nodes.begin(), other.nodes.end()) &&
         std::includes(bodies.begin(), bodies.end(), other.bodies.begin(), other.bodies.end());
}

void ImpactZones::FixedMembers::add(const FixedMembers& other) {
  nodes.insert(other.nodes.begin(), other.nodes.end());
  bodies.insert(other.bodies.begin(), other.bodies.end());
}

ImpactZones::ImpactZones(const Motion& motion)
    : zones_(motion.inverse_mass.size() + motion.rigid.size()),
      held_(zones_.size(), 0),
      solved_(motion.solved),
      rigid_(motion.rigid) {}

std::int64_t ImpactZones::node_count() {
  std::vector<char> in_zone(zones_.size(), 0);
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(zones_.size()); ++i) {
    if (zones_.find(i) != i) in_zone[i] = in_zone[zones_.find(i)] = 1;
  }
  for (const auto& guided : fixed_members_) in_zone[guided.first] = 1;
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
    } else if (motion.is_soft(v) && motion.anchor_body_of(v) >= 0) {
      members.push_back(motion.soft_count() + motion.anchor_body_of(v));
    }
  }
  return members;
}

ImpactZones::FixedMembers ImpactZones::fixed_members_of(const Contact& contact, const Motion& motion) {
  FixedMembers fixed;
  for (const std::int32_t b : {contact.body_a, contact.body_b}) {
    const int body = motion.rigid_of_body[b];
    if (body >= 0 && !motion.rigid[body].is_dynamic()) fixed.bodies.insert(body);
  }
  // What is free follows the body and leaves the pinned node behind.
  if (is_prescribed(contact, motion)) return fixed;
  for (const std::int32_t v : contact.vertices) {
    if (is_pinned(v, motion)) fixed.nodes.insert(v);
  }
  return fixed;
}

bool ImpactZones::is_tied(const Contact& contact, const Motion& motion) {
  const std::vector<std::int32_t> members = members_of(contact, motion);
  if (members.empty()) return true;
  for (const std::int32_t member : members) {
    if (zones_.find(member) != zones_.find(members[0])) return false;
  }
  const FixedMembers fixed = fixed_members_of(contact, motion);
  if (fixed.empty()) return true;
  const auto all = fixed_members_.find(zones_.find(members[0]));
  return all != fixed_members_.end() && all->second.include(fixed);
}

bool ImpactZones::tie(const Contact& contact, const Motion& motion) {
  if (is_tied(contact, motion)) return false;
  const std::vector<std::int32_t> members = members_of(contact, motion);
  for (const std::int32_t member : members) zones_.join(members[0], member);
  const FixedMembers fixed = fixed_members_of(contact, motion);
  if (!fixed.empty()) fixed_members_[zones_.find(members[0])].add(fixed);
  return true;
}

bool ImpactZones::absorb(const std::vector<Contact>& contacts, Motion& motion) {
  bool more = false;
  for (const Contact& contact : contacts) more = tie(contact, motion) || more;
  move_all(motion);
  return more;
}

bool ImpactZones::hold(const std::vector<Contact>& contacts, bool whole_bodies, Motion& motion) {
  bool more = false;
  for (const Contact& contact : contacts) {
    more = tie(contact, motion) || more;
    std::vector<std::int32_t> held = members_of(contact, motion);
    if (whole_bodies) {
      for (const std::int32_t body : {contact.body_a, contact.body_b}) {
        for (std::int32_t v = motion.first_vertex[body]; v < motion.first_vertex[body + 1]; ++v) {
          if (motion.is_soft(v) && motion.inverse_mass[v] > 0) held.push_back(v);
        }
      }
    }
    for (const std::int32_t member : held) {
      more = zones_.join(held[0], member) || more;
      more = more || !held_[member];
      held_[member] = 1;
    }
  }
  move_all(motion);
  return more;
}

bool ImpactZones::is_unresolvable(const Contact& contact, const Motion& motion) {
  return is_prescribed(contact, motion) && is_tied(contact, motion);
}

bool ImpactZones::stop_prescribed(const std::vector<Contact>& contacts, Motion& motion) {
  bool more = false;
  const auto hold_member = [&](std::int32_t member) {
    more = more || !held_[member];
    held_[member] = 1;
  };
  const auto stop = [&](const FixedMembers& fixed) {
    for (const std::int32_t v : fixed.nodes) {
      hold_member(v);
      stay(v, motion);
    }
    for (const int body : fixed.bodies) {
      if (motion.rigid[body].start == motion.rigid[body].end) continue;
      hold_member(motion.soft_count() + body);
      motion.put(motion.rigid[body], motion.rigid[body].start);
    }
  };
  for (const Contact& contact : contacts) {
    stop(fixed_members_of(contact, motion));
    for (const std::int32_t member : members_of(contact, motion)) {
      const auto guided = fixed_members_.find(zones_.find(member));
      if (guided != fixed_members_.end()) stop(guided->second);
    }
  }
  move_all(motion);
  return more;
}

void ImpactZones::move_all(Motion& motion) {
  std::map<std::int32_t, FixedMembers> fixed;
  for (const auto& guided : fixed_members_) fixed[zones_.find(guided.first)].add(guided.second);
  fixed_members_ = std::move(fixed);
  std::map<std::int32_t, Zone> zones;
  for (const auto& guided : fixed_members_) zones[guided.first];
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
    const auto guide = fixed_members_.find(zone.first);
    move(zone.second, guide == fixed_members_.end() ? FixedMembers() : guide->second, motion);
  }
}

void ImpactZones::move(const Zone& zone, const FixedMembers& fixed, Motion& motion) const {
  // A guide that stays or several that differ hold the zone; one motion that all share moves it.
  RigidStep guided;
  bool is_guided = false, alike = true;
  const auto follow = [&](const RigidStep& step) {
    alike = alike && (!is_guided || (step.translation == guided.translation && step.centre == guided.centre &&
                                     step.rotation == guided.rotation));
    guided = step;
    is_guided = true;
  };
  for (const int body : fixed.bodies) follow(step_of(motion.rigid[body]));
  for (const std::int32_t v : fixed.nodes) {
    if (is_guided && guided.has_anchored_nodes(v, motion)) continue;
    RigidStep step;
    step.translation = motion.end_of(v) - motion.start_of(v);
    follow(step);
  }
  if (!alike) guided = RigidStep();

  RigidStep free;
  if (!is_guided) {
    Matter matter;
    for (const std::int32_t v : zone.nodes) {
      const Vector3d start = motion.start_of(v);
      matter.add(1 / motion.inverse_mass[v], start, solved_[v] - start);
    }
    for (const int b : zone.bodies) {
      const RigidMotion& body = rigid_[b];
      const Vector3d moved = to_eigen(body.predicted.getOrigin()) + body.translation - body.centre();
      matter.add(body.mass(), body.centre(), moved);
    }
    if (matter.mass > 0) {
      free.centre = matter.centre / matter.mass;
      free.translation = matter.translation / matter.mass;
    } else if (!zone.bodies.empty()) {
      free.centre = rigid_[zone.bodies.front()].centre();
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
      add(body.mass(), body.centre(),
          to_eigen(body.predicted.getOrigin()) + body.translation - body.centre());
      const Matrix3d own = body.inertia();
      inertia += own;
      momentum += own * turn_over_step(body, body.rotation);
    }
    Vector3d rotation = turn_of(inertia, momentum);
    if (rotation.norm() > largest_turn) rotation *= largest_turn / rotation.norm();
    for (const int b : zone.bodies) {
      if (!rigid_[b].is_locked()) continue;
      free.translation = (rigid_[b].inverse_mass.array() > 0).select(free.translation, 0);
      rotation.setZero();
    }
    free.rotation = rotation_by(rotation);
  }
  const RigidStep& moves = is_guided ? guided : free;
  const RigidStep goes = zone.held && !is_guided ? RigidStep() : moves;

  for (const std::int32_t v : zone.nodes) {
    const Vector3d start = motion.start_of(v);
    motion.solved[v] = moves(start);
    if (goes.stays()) {
      stay(v, motion);
    } else {
      motion.split_displacement[v].setZero();
      motion.round_end(v);
    }
  }
  for (const int b : zone.bodies) {
    RigidMotion& body = motion.rigid[b];
    const Matrix3d back =
        (to_eigen(body.predicted.getBasis()) * to_eigen(body.start.getBasis()).transpose())
            .transpose();
    const Vector3d predicted = to_eigen(body.predicted.getOrigin());
    body.translation = moves(body.centre()) - predicted;
    body.rotation = rotation_vector(moves.rotation * back);
    body.split_translation = goes(body.centre()) - moves(body.centre());
    body.split_rotation.setZero();
    if (goes.stays()) {
      motion.hold(body);
    } else {
      motion.place(body);
    }
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
