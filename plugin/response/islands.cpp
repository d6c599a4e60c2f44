#include "response/islands.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Speed of a vertex of infinite mass, m/s; `body` is its rigid body or null. Of a conveyor it is
// the speed that Bullet stores. Any other body may make up for a lag, or move by a frame's motion
// in one substep, so it is at most that speed. If that is zero, the body was put elsewhere, and the
// displacement counts.
double prescribed_speed_of(std::int32_t v, const RigidMotion* body, const Motion& motion) {
  const double speed = (motion.end_of(v) - motion.start_of(v)).norm() / motion.dt();
  if (!body || (body->velocity.isZero() && body->angular_velocity.isZero())) return speed;
  const double stored_speed = body->velocity_at(motion.start_of(v)).norm();
  return body->is_conveyor ? stored_speed : std::min(speed, stored_speed);
}

// Speed of the fastest vertex of a body that is of infinite mass or that the application moves,
// m/s; none if it has no such vertex.
std::optional<double> prescribed_speed_of(std::int32_t body, const Motion& motion) {
  const int rigid = motion.rigid_of_body()[body];
  const bool has_velocity = rigid >= 0 && !motion.rigid()[rigid].is_driven;
  const RigidMotion* const obstacle = has_velocity ? &motion.rigid()[rigid] : nullptr;
  std::optional<double> fastest;
  for (std::int32_t v = motion.first_vertex()[body]; v < motion.first_vertex()[body + 1]; ++v) {
    if (motion.is_free(v) || (motion.is_soft(v) && motion.anchor_body_of(v) >= 0)) continue;
    fastest = std::max(fastest.value_or(0), prescribed_speed_of(v, obstacle, motion));
  }
  return fastest;
}

bool is_movable(std::int32_t body, const Motion& motion) {
  const int rigid = motion.rigid_of_body()[body];
  return rigid < 0 || motion.rigid()[rigid].is_movable();
}

}  // namespace

void Island::add_fixed(std::optional<double> speed) {
  if (!speed) return;
  free = false;
  prescribed_speed = std::max(prescribed_speed, *speed);
}

void Islands::find(const std::vector<const ContactRow*>& rows,
                   const std::vector<std::int32_t>& others, const Motion& motion) {
  sets_.reset(motion.rigid_of_body().size());
  in_contact_.assign(sets_.size(), 0);
  is_carrier_.assign(sets_.size(), 0);
  for (const std::int32_t body : others) in_contact_[body] = 1;
  join_contacts(rows, motion);
  join_anchored(motion);
  number_islands();
  add_bodies(motion);
  add_fixed(rows, motion);
}

void Islands::join_contacts(const std::vector<const ContactRow*>& rows, const Motion& motion) {
  for (const ContactRow* const row : rows) {
    const std::int32_t a = row->contact.body_a, b = row->contact.body_b;
    for (const std::int32_t body : {a, b})
      if (is_movable(body, motion)) in_contact_[body] = 1;
    if (is_movable(a, motion) && is_movable(b, motion)) sets_.join(a, b);
  }
}

// Contacts of an anchored vertex also push the rigid body that it is anchored to.
void Islands::join_anchored(const Motion& motion) {
  body_of_rigid_.resize(motion.rigid().size());
  for (std::size_t body = 0; body < motion.rigid_of_body().size(); ++body) {
    const int rigid = motion.rigid_of_body()[body];
    if (rigid >= 0) body_of_rigid_[rigid] = static_cast<std::int32_t>(body);
  }
  for (const auto& [vertex, anchored] : motion.anchored()) {
    const auto next =
        std::upper_bound(motion.first_vertex().begin(), motion.first_vertex().end(), vertex);
    const auto body = static_cast<std::int32_t>(next - motion.first_vertex().begin()) - 1;
    if (!in_contact_[body]) continue;
    const std::int32_t rigid_body = body_of_rigid_[anchored.rigid];
    is_carrier_[rigid_body] = !in_contact_[rigid_body];
    sets_.join(body, rigid_body);
  }
  for (std::size_t body = 0; body < in_contact_.size(); ++body)
    if (is_carrier_[body]) in_contact_[body] = 1;
}

void Islands::number_islands() {
  islands_.clear();
  bodies_.clear();
  island_of_.assign(sets_.size(), -1);
  for (std::int32_t body = 0; body < static_cast<std::int32_t>(sets_.size()); ++body) {
    if (!in_contact_[body]) continue;
    bodies_.push_back(body);
    const std::int32_t first = sets_.find(body);
    if (first == body) islands_.emplace_back();
    island_of_[body] =
        first == body ? static_cast<std::int32_t>(islands_.size()) - 1 : island_of_[first];
  }
  std::sort(bodies_.begin(), bodies_.end(), [this](std::int32_t a, std::int32_t b) {
    return std::pair(island_of_[a], a) < std::pair(island_of_[b], b);
  });
}

void Islands::add_bodies(const Motion& motion) {
  articulated_.clear();
  masses_.clear();
  parts_.clear();
  begin_.assign(1, {});
  for (std::size_t i = 0; i < islands_.size(); ++i) {
    std::size_t end = begin_[i].body;
    for (; end < bodies_.size() && island_of_[bodies_[end]] == static_cast<std::int32_t>(i); ++end)
      add_body(bodies_[end], begin_[i].articulated, motion, islands_[i]);
    islands_[i].bodies = {bodies_.data() + begin_[i].body, end - begin_[i].body};
    add_masses(islands_[i].bodies, motion);
    begin_.push_back({end, articulated_.size(), masses_.size(), parts_.size()});
  }
  for (std::size_t i = 0; i < islands_.size(); ++i) {
    const Begin &begin = begin_[i], &end = begin_[i + 1];
    islands_[i].articulated = {articulated_.data() + begin.articulated,
                               end.articulated - begin.articulated};
    islands_[i].masses = {masses_.data() + begin.mass, end.mass - begin.mass};
    islands_[i].parts = {parts_.data() + begin.part, end.part - begin.part};
  }
}

void Islands::add_body(std::int32_t body, std::size_t first_articulated, const Motion& motion,
                       Island& island) {
  const RigidMotion* const rigid =
      motion.rigid_of_body()[body] < 0 ? nullptr : &motion.rigid_of(body);
  if (rigid && rigid->is_driven) island.add_fixed(prescribed_speed_of(body, motion));
  if (rigid && rigid->is_dynamic()) {
    island.free = island.free && !rigid->is_locked() && !rigid->supported_mobility;
  } else if (rigid && rigid->articulated >= 0) {
    island.free = false;
    const auto first = articulated_.begin() + static_cast<std::ptrdiff_t>(first_articulated);
    if (std::find(first, articulated_.end(), rigid->articulated) == articulated_.end())
      articulated_.push_back(rigid->articulated);
  } else {
    island.add_fixed(prescribed_speed_of(body, motion));
  }
}

void Islands::add_masses(Span<const std::int32_t> bodies, const Motion& motion) {
  constexpr std::int32_t part_size = 1024;
  const std::size_t first = masses_.size();
  std::int32_t count = part_size;  // of the last part; full, so that the first range begins one
  const auto add = [&](const MassRange& range, std::int32_t size) {
    if (count + size > part_size) {
      parts_.push_back(masses_.size() - first);
      count = 0;
    }
    masses_.push_back(range);
    count += size;
  };
  for (const std::int32_t body : bodies) {
    if (motion.rigid_of_body()[body] >= 0) {
      add({motion.rigid_of_body()[body], is_carrier_[body] != 0, 0, 0}, 1);
      continue;
    }
    const std::int32_t last = motion.first_vertex()[body + 1];
    for (std::int32_t v = motion.first_vertex()[body]; v < last; v += part_size) {
      const std::int32_t next = std::min(v + part_size, last);
      add({-1, false, v, next}, next - v);
    }
  }
  parts_.push_back(masses_.size() - first);
}

void Islands::add_fixed(const std::vector<const ContactRow*>& rows, const Motion& motion) {
  fixed_.assign(in_contact_.size(), {});
  for (const ContactRow* const row : rows) {
    std::int32_t fixed = row->contact.body_a, other = row->contact.body_b;
    if (is_movable(fixed, motion)) std::swap(fixed, other);
    if (is_movable(fixed, motion) || !is_movable(other, motion)) continue;
    if (!fixed_[fixed].is_known) fixed_[fixed] = {true, prescribed_speed_of(fixed, motion)};
    islands_[island_of_[other]].add_fixed(fixed_[fixed].speed);
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
