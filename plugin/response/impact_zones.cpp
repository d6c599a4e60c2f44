#include "response/impact_zones.h"

#include <algorithm>
#include <utility>

#include "lazyccd/debug/assert.h"
#include "motion/articulated_motion.h"
#include "motion/rigid_step.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Whether a vertex is pinned. For an anchored vertex the zones contain the rigid body instead.
bool is_pinned(std::int32_t v, const Motion& motion) {
  return motion.is_soft(v) && motion.inverse_mass()[v] == 0 && motion.anchor_body_of(v) < 0;
}

// Whether the contact is between a moving kinematic body and a pinned node that moves in another
// way. Applications have such pairs.
bool has_conflicting_motion(const Contact& contact, const Motion& motion) {
  const int a = motion.rigid_of_body()[contact.body_a], b = motion.rigid_of_body()[contact.body_b];
  if (a < 0 && b < 0) return false;
  const RigidMotion& body = motion.rigid()[a >= 0 ? a : b];
  if (body.is_movable() || body.stands_still()) return false;
  const RigidStep step = step_of(body);
  return std::any_of(contact.vertices.begin(), contact.vertices.end(), [&](std::int32_t v) {
    return is_pinned(v, motion) && motion.end_of(v) == motion.predicted[v] &&
           !step.moves_along(v, motion);
  });
}

}  // namespace

ImpactZones::ImpactZones(const Motion& motion, const Threads& threads)
    : soft_count_(motion.soft_count()),
      zones_(motion.inverse_mass().size() + motion.rigid().size()),
      held_(zones_.size(), 0),
      in_zone_(zones_.size(), 0),
      zone_motion_(motion, threads) {}

std::int64_t ImpactZones::node_count() const {
  return std::count(in_zone_.begin(), in_zone_.begin() + soft_count_, 1);
}

std::int64_t ImpactZones::held_count() const { return std::count(held_.begin(), held_.end(), 1); }

bool ImpactZones::join(std::int32_t a, std::int32_t b) {
  for (const std::int32_t member : {a, b}) {
    LAZYCCD_ASSERT(member >= 0 && static_cast<std::size_t>(member) < in_zone_.size(),
                   "members of zones are nodes and rigid bodies of the motion");
    if (!in_zone_[member]) members_.push_back(member);
    in_zone_[member] = 1;
  }
  return zones_.join(a, b);
}

bool ImpactZones::hold(std::int32_t member) {
  const bool is_new = !held_[member];
  held_[member] = 1;
  return is_new;
}

std::vector<std::int32_t> ImpactZones::members_of(const Contact& contact, const Motion& motion) {
  std::vector<std::int32_t> members;
  for (const std::int32_t b : {contact.body_a, contact.body_b}) {
    const int body = motion.rigid_of_body()[b];
    if (body >= 0 && motion.rigid()[body].is_dynamic())
      members.push_back(motion.soft_count() + body);
  }
  for (const std::int32_t v : contact.vertices) {
    if (motion.is_free(v)) {
      members.push_back(v);
    } else if (motion.is_soft(v)) {
      const int anchor = motion.anchor_body_of(v);
      if (anchor >= 0 && motion.rigid()[anchor].is_dynamic())
        members.push_back(motion.soft_count() + anchor);
    }
  }
  return members;
}

PrescribedMembers ImpactZones::prescribed_members_of(const Contact& contact, const Motion& motion) {
  PrescribedMembers prescribed;
  for (const std::int32_t b : {contact.body_a, contact.body_b}) {
    const int body = motion.rigid_of_body()[b];
    if (body >= 0 && !motion.rigid()[body].is_dynamic()) prescribed.bodies.insert(body);
  }
  // The free members follow the body and leave the pinned node behind.
  if (has_conflicting_motion(contact, motion)) return prescribed;
  for (const std::int32_t v : contact.vertices) {
    if (is_pinned(v, motion)) prescribed.nodes.insert(v);
    const int anchor = motion.is_soft(v) ? motion.anchor_body_of(v) : -1;
    if (anchor >= 0 && !motion.rigid()[anchor].is_dynamic()) prescribed.bodies.insert(anchor);
  }
  return prescribed;
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
  const bool noted = zone_motion_.note_vertices(contact, motion);
  if (is_merged(contact, motion)) return noted;
  const std::vector<std::int32_t> members = members_of(contact, motion);
  for (const std::int32_t member : members) join(members[0], member);
  const PrescribedMembers prescribed = prescribed_members_of(contact, motion);
  if (!prescribed.empty()) prescribed_members_[zones_.find(members[0])].add(prescribed);
  return true;
}

bool ImpactZones::absorb(const std::vector<Contact>& contacts, Motion& motion) {
  bool changed = false;
  for (const Contact& contact : contacts) changed = merge(contact, motion) || changed;
  zone_motion_.move(list(motion), motion);
  return changed;
}

bool ImpactZones::hold(const std::vector<Contact>& contacts, bool whole_bodies, Motion& motion) {
  bool changed = false;
  for (const Contact& contact : contacts) {
    changed = merge(contact, motion) || changed;
    std::vector<std::int32_t> held = members_of(contact, motion);
    if (whole_bodies) {
      for (const std::int32_t body : {contact.body_a, contact.body_b}) {
        for (std::int32_t v = motion.first_vertex()[body]; v < motion.first_vertex()[body + 1];
             ++v) {
          if (motion.is_soft(v) && motion.inverse_mass()[v] > 0) held.push_back(v);
        }
      }
    }
    for (const std::int32_t member : held) {
      changed = join(held[0], member) || changed;
      changed = hold(member) || changed;
    }
  }
  zone_motion_.move(list(motion), motion);
  return changed;
}

bool ImpactZones::is_unresolvable(const Contact& contact, const Motion& motion) {
  return has_conflicting_motion(contact, motion) && is_merged(contact, motion);
}

bool ImpactZones::stop_prescribed(const std::vector<Contact>& contacts, Motion& motion) {
  bool changed = false;
  const auto stop = [&](const PrescribedMembers& prescribed) {
    for (const std::int32_t v : prescribed.nodes) {
      changed = hold(v) || changed;
      motion.set_end_to_start(v);
    }
    for (const int body : prescribed.bodies) {
      if (motion.rigid()[body].stands_still()) continue;
      changed = hold(motion.soft_count() + body) || changed;
      const int articulated = motion.rigid()[body].articulated;
      if (articulated >= 0) {
        motion.hold_at_start(motion.articulated[articulated]);
      } else {
        motion.set_end_to_start(motion.rigid()[body]);
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
  zone_motion_.move(list(motion), motion);
  return changed;
}

std::vector<ImpactZone> ImpactZones::list(const Motion& motion) {
  std::map<std::int32_t, PrescribedMembers> prescribed;
  for (const auto& entry : prescribed_members_)
    prescribed[zones_.find(entry.first)].add(entry.second);
  prescribed_members_ = std::move(prescribed);

  const auto zone_and_index = [&](std::int32_t member) {
    return std::make_pair(zones_.find(member), member);
  };
  std::sort(members_.begin(), members_.end(),
            [&](std::int32_t a, std::int32_t b) { return zone_and_index(a) < zone_and_index(b); });
  std::vector<ImpactZone> zones;
  for (const std::int32_t member : members_) {
    const std::int32_t representative = zones_.find(member);
    if (representative == member) {  // the smallest of its zone
      ImpactZone& zone = zones.emplace_back();
      const auto known = prescribed_members_.find(representative);
      if (known != prescribed_members_.end()) zone.prescribed = known->second;
    }
    LAZYCCD_ASSERT(in_zone_[representative] && !zones.empty(),
                   "a zone begins with its representative");
    ImpactZone& zone = zones.back();
    if (member < motion.soft_count()) {
      zone.nodes.push_back(member);
    } else {
      zone.bodies.push_back(member - motion.soft_count());
    }
    zone.held = zone.held || held_[member];
  }
  return zones;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
