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
  Vector3d centre = Vector3d::Zero(), shift = Vector3d::Zero();
  Matrix3d rotation = Matrix3d::Identity();

  Vector3d operator()(const Vector3d& x) const { return rotation * (x - centre) + centre + shift; }
  bool stays() const { return shift.isZero(0) && rotation.isIdentity(0); }
  // Within what rounding makes of it.
  bool carries(std::int32_t soft_vertex, const Motion& motion) const {
    const Vector3d start = motion.start_of(soft_vertex), end = motion.end_of(soft_vertex);
    return ((*this)(start)-end).norm() <= 1e-3 * (end - start).norm();
  }
};

RigidStep step_of(const RigidMotion& body) {
  if (body.start == body.end) return {};
  RigidStep step;
  step.centre = body.centre();
  step.shift = to_eigen(body.end.getOrigin()) - step.centre;
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
  motion.opening[soft_vertex] = motion.start_of(soft_vertex) - motion.solved[soft_vertex];
  const auto first = 3 * static_cast<std::ptrdiff_t>(soft_vertex);
  std::copy_n(motion.start.begin() + first, 3, motion.end.begin() + first);
}

// What carries it is a member of zones in its place.
bool is_pinned(std::int32_t v, const Motion& motion) {
  return motion.is_soft(v) && motion.inverse_mass[v] == 0 && motion.carrier_of(v) < 0;
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
           !step.carries(v, motion);
  });
}

// Mass and moments of what moves together.
struct Matter {
  double mass = 0;
  Vector3d centre = Vector3d::Zero(), shift = Vector3d::Zero();

  void add(double m, const Vector3d& at, const Vector3d& moved) {
    mass += m;
    centre += m * at;
    shift += m * moved;
  }
};

}  // namespace

bool ImpactZones::Guides::include(const Guides& other) const {
  return std::includes(nodes.begin(), nodes.end(), other.nodes.begin(), other.nodes.end()) &&
         std::includes(bodies.begin(), bodies.end(), other.bodies.begin(), other.bodies.end());
}

void ImpactZones::Guides::add(const Guides& other) {
  nodes.insert(other.nodes.begin(), other.nodes.end());
  bodies.insert(other.bodies.begin(), other.bodies.end());
}

ImpactZones::ImpactZones(const Motion& motion)
    : parent_(motion.inverse_mass.size() + motion.rigid.size()),
      held_(parent_.size(), 0),
      solved_(motion.solved),
      rigid_(motion.rigid) {
  std::iota(parent_.begin(), parent_.end(), 0);
}

std::int32_t ImpactZones::find(std::int32_t i) {
  while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
  return i;
}

bool ImpactZones::join(std::int32_t a, std::int32_t b) {
  a = find(a);
  b = find(b);
  parent_[std::max(a, b)] = std::min(a, b);
  return a != b;
}

std::int64_t ImpactZones::node_count() const {
  std::vector<char> in_zone(parent_.size(), 0);
  for (std::size_t i = 0; i < parent_.size(); ++i) {
    if (parent_[i] != static_cast<std::int32_t>(i)) in_zone[i] = in_zone[parent_[i]] = 1;
  }
  for (const auto& guided : guides_) in_zone[guided.first] = 1;
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
    } else if (motion.is_soft(v) && motion.carrier_of(v) >= 0) {
      members.push_back(motion.soft_count() + motion.carrier_of(v));
    }
  }
  return members;
}

ImpactZones::Guides ImpactZones::guides_of(const Contact& contact, const Motion& motion) {
  Guides guides;
  for (const std::int32_t b : {contact.body_a, contact.body_b}) {
    const int body = motion.rigid_of_body[b];
    if (body >= 0 && !motion.rigid[body].is_dynamic()) guides.bodies.insert(body);
  }
  // What is free follows the body and leaves the pinned node behind.
  if (is_prescribed(contact, motion)) return guides;
  for (const std::int32_t v : contact.vertices) {
    if (is_pinned(v, motion)) guides.nodes.insert(v);
  }
  return guides;
}

bool ImpactZones::is_tied(const Contact& contact, const Motion& motion) {
  const std::vector<std::int32_t> members = members_of(contact, motion);
  if (members.empty()) return true;
  for (const std::int32_t member : members) {
    if (find(member) != find(members[0])) return false;
  }
  const Guides guides = guides_of(contact, motion);
  if (guides.empty()) return true;
  const auto all = guides_.find(find(members[0]));
  return all != guides_.end() && all->second.include(guides);
}

bool ImpactZones::tie(const Contact& contact, const Motion& motion) {
  if (is_tied(contact, motion)) return false;
  const std::vector<std::int32_t> members = members_of(contact, motion);
  for (const std::int32_t member : members) join(members[0], member);
  const Guides guides = guides_of(contact, motion);
  if (!guides.empty()) guides_[find(members[0])].add(guides);
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
      more = join(held[0], member) || more;
      more = more || !held_[member];
      held_[member] = 1;
    }
  }
  move_all(motion);
  return more;
}

bool ImpactZones::is_hopeless(const Contact& contact, const Motion& motion) {
  return is_prescribed(contact, motion) && is_tied(contact, motion);
}

bool ImpactZones::stop_driven(const std::vector<Contact>& contacts, Motion& motion) {
  bool more = false;
  const auto hold_member = [&](std::int32_t member) {
    more = more || !held_[member];
    held_[member] = 1;
  };
  const auto stop = [&](const Guides& guides) {
    for (const std::int32_t v : guides.nodes) {
      hold_member(v);
      stay(v, motion);
    }
    for (const int body : guides.bodies) {
      if (motion.rigid[body].start == motion.rigid[body].end) continue;
      hold_member(motion.soft_count() + body);
      motion.put(motion.rigid[body], motion.rigid[body].start);
    }
  };
  for (const Contact& contact : contacts) {
    stop(guides_of(contact, motion));
    for (const std::int32_t member : members_of(contact, motion)) {
      const auto guided = guides_.find(find(member));
      if (guided != guides_.end()) stop(guided->second);
    }
  }
  move_all(motion);
  return more;
}

void ImpactZones::move_all(Motion& motion) {
  std::map<std::int32_t, Guides> guides;
  for (const auto& guided : guides_) guides[find(guided.first)].add(guided.second);
  guides_ = std::move(guides);
  std::map<std::int32_t, Zone> zones;
  for (const auto& guided : guides_) zones[guided.first];
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(parent_.size()); ++i) {
    if (find(i) != i) zones[find(i)];
  }
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(parent_.size()); ++i) {
    const auto at = zones.find(find(i));
    if (at == zones.end()) continue;
    if (i < motion.soft_count()) {
      at->second.nodes.push_back(i);
    } else {
      at->second.bodies.push_back(i - motion.soft_count());
    }
    at->second.held = at->second.held || held_[i];
  }
  for (const auto& zone : zones) {
    const auto guide = guides_.find(zone.first);
    move(zone.second, guide == guides_.end() ? Guides() : guide->second, motion);
  }
}

void ImpactZones::move(const Zone& zone, const Guides& guides, Motion& motion) const {
  // A guide that stays or several that differ hold the zone; one motion that all share moves it.
  RigidStep guided;
  bool is_guided = false, alike = true;
  const auto follow = [&](const RigidStep& step) {
    alike = alike && (!is_guided || (step.shift == guided.shift && step.centre == guided.centre &&
                                     step.rotation == guided.rotation));
    guided = step;
    is_guided = true;
  };
  for (const int body : guides.bodies) follow(step_of(motion.rigid[body]));
  for (const std::int32_t v : guides.nodes) {
    if (is_guided && guided.carries(v, motion)) continue;
    RigidStep step;
    step.shift = motion.end_of(v) - motion.start_of(v);
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
      const Vector3d moved = to_eigen(body.predicted.getOrigin()) + body.shift - body.centre();
      matter.add(body.mass(), body.centre(), moved);
    }
    if (matter.mass > 0) {
      free.centre = matter.centre / matter.mass;
      free.shift = matter.shift / matter.mass;
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
          to_eigen(body.predicted.getOrigin()) + body.shift - body.centre());
      const Matrix3d own = body.inertia();
      inertia += own;
      momentum += own * turn_over_step(body, body.turn);
    }
    Vector3d turn = turn_of(inertia, momentum);
    if (turn.norm() > largest_turn) turn *= largest_turn / turn.norm();
    for (const int b : zone.bodies) {
      if (!rigid_[b].is_locked()) continue;
      free.shift = (rigid_[b].inverse_mass.array() > 0).select(free.shift, 0);
      turn.setZero();
    }
    free.rotation = rotation_by(turn);
  }
  const RigidStep& moves = is_guided ? guided : free;
  const RigidStep goes = zone.held && !is_guided ? RigidStep() : moves;

  for (const std::int32_t v : zone.nodes) {
    const Vector3d start = motion.start_of(v);
    motion.solved[v] = moves(start);
    if (goes.stays()) {
      stay(v, motion);
    } else {
      motion.opening[v].setZero();
      motion.round_end(v);
    }
  }
  for (const int b : zone.bodies) {
    RigidMotion& body = motion.rigid[b];
    const Matrix3d back =
        (to_eigen(body.predicted.getBasis()) * to_eigen(body.start.getBasis()).transpose())
            .transpose();
    const Vector3d predicted = to_eigen(body.predicted.getOrigin());
    body.shift = moves(body.centre()) - predicted;
    body.turn = rotation_vector(moves.rotation * back);
    body.opening_shift = goes(body.centre()) - moves(body.centre());
    body.opening_turn.setZero();
    if (goes.stays()) {
      motion.hold(body);
    } else {
      motion.place(body);
    }
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
