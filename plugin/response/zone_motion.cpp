#include "response/zone_motion.h"

#include <algorithm>

#include "motion/rotation.h"
#include "response/part_sums.h"
#include "settings.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Members in one part of a sum. Zones with more of them are moved one after the other, by all
// threads together.
constexpr std::size_t part_size = 1024;
// Zones that one thread moves at a time.
constexpr std::size_t zone_grain = 16;

// Rotation vector of a body from its start to its predicted pose, turned further by
// `response_rotation`.
Vector3d rotation_over_step(const RigidMotion& body, const Vector3d& response_rotation) {
  const Matrix3d whole = rotation_by(response_rotation) * to_double(body.predicted.getBasis()) *
                         to_double(body.start.getBasis()).transpose();
  return rotation_vector(whole);
}

// Sums of mass and of mass times position and displacement.
struct MassSum {
  double mass = 0;
  Vector3d position = Vector3d::Zero(), displacement = Vector3d::Zero();

  void include(const MassSum& other) {
    mass += other.mass;
    position += other.position;
    displacement += other.displacement;
  }
};

// Sums of inertia, and of inertia times rotation, about one point.
struct SpinSum {
  Matrix3d inertia = Matrix3d::Zero();
  Vector3d momentum = Vector3d::Zero();

  void include(const SpinSum& other) {
    inertia += other.inertia;
    momentum += other.momentum;
  }
};

std::size_t size_of(const ImpactZone& zone) { return zone.nodes.size() + zone.bodies.size(); }

bool is_axis_locked(const RigidMotion& body, int axis) { return !(body.inverse_mass[axis] > 0); }

}  // namespace

bool PrescribedMembers::include(const PrescribedMembers& other) const {
  return std::includes(nodes.begin(), nodes.end(), other.nodes.begin(), other.nodes.end()) &&
         std::includes(bodies.begin(), bodies.end(), other.bodies.begin(), other.bodies.end());
}

void PrescribedMembers::add(const PrescribedMembers& other) {
  nodes.insert(other.nodes.begin(), other.nodes.end());
  bodies.insert(other.bodies.begin(), other.bodies.end());
}

struct ZoneMotion::Member {
  double mass;                   // kg
  Vector3d start, displacement;  // metres; the displacement before any zone
  const RigidMotion* turning;    // the body that turns with the zone, or null
};

ZoneMotion::ZoneMotion(const Motion& motion, const Threads& threads)
    : threads_(threads),
      zone_vertex_(motion.rigid().size(), in_no_zone),
      solved_(motion.solved),
      rigid_(motion.rigid()) {}

bool ZoneMotion::note_vertices(const Contact& contact, const Motion& motion) {
  bool changed = false;
  const auto note = [&](int body, std::int32_t vertex) {
    if (body < 0 || !motion.rigid()[body].is_dynamic()) return;
    std::int32_t& known = zone_vertex_[body];
    const std::int32_t now = known == in_no_zone || known == vertex ? vertex : turns;
    changed = changed || known != now;
    known = now;
  };
  for (const std::int32_t b : {contact.body_a, contact.body_b})
    note(motion.rigid_of_body()[b], turns);
  for (const std::int32_t v : contact.vertices) {
    if (motion.is_soft(v)) note(motion.anchor_body_of(v), v);
  }
  return changed;
}

void ZoneMotion::move(const std::vector<ImpactZone>& zones, Motion& motion) const {
  const auto is_large = [](const ImpactZone& zone) { return size_of(zone) > part_size; };
  threads_.parallel_for(zones.size(), zone_grain, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      if (!is_large(zones[i])) move(zones[i], motion);
    }
  });
  for (const ImpactZone& zone : zones) {
    if (is_large(zone)) move(zone, motion);
  }
}

Vector3d ZoneMotion::start_of_body(int body, const Motion& motion) const {
  return turns_with_zone(body) ? rigid_[body].centre() : motion.start_of(zone_vertex_[body]);
}

Vector3d ZoneMotion::end_of_body(int body, const Motion& motion) const {
  const RigidMotion& moved = rigid_[body];
  const Vector3d centre = to_double(moved.predicted.getOrigin()) + moved.translation;
  if (turns_with_zone(body)) return centre;
  const btVector3& local = motion.anchored().find(zone_vertex_[body])->local;
  return centre + rotation_by(moved.rotation) * to_double(moved.predicted.getBasis() * local);
}

ZoneMotion::Member ZoneMotion::member_of(const ImpactZone& zone, std::size_t i,
                                         const Motion& motion) const {
  if (i < zone.nodes.size()) {
    const std::int32_t v = zone.nodes[i];
    const Vector3d start = motion.start_of(v);
    return {1 / motion.inverse_mass()[v], start, solved_[v] - start, nullptr};
  }
  const int b = zone.bodies[i - zone.nodes.size()];
  const Vector3d start = start_of_body(b, motion);
  return {rigid_[b].mass(), start, end_of_body(b, motion) - start,
          turns_with_zone(b) ? &rigid_[b] : nullptr};
}

template <class Sum, class Each>
Sum ZoneMotion::sum(const ImpactZone& zone, const Motion& motion, const Each& each) const {
  const std::size_t count = size_of(zone);
  return sum_of_parts(threads_, (count + part_size - 1) / part_size, Sum(), [&](std::size_t part) {
    Sum sum;
    const std::size_t last = std::min(count, (part + 1) * part_size);
    for (std::size_t i = part * part_size; i < last; ++i) each(member_of(zone, i, motion), sum);
    return sum;
  });
}

std::optional<RigidStep> ZoneMotion::prescribed_step_of(const PrescribedMembers& members,
                                                        const Motion& motion) {
  std::optional<RigidStep> prescribed;
  bool is_consistent = true;
  const auto follow = [&](const RigidStep& step) {
    is_consistent = is_consistent && (!prescribed || step == *prescribed);
    prescribed = step;
  };
  for (const int body : members.bodies) follow(step_of(motion.rigid()[body]));
  for (const std::int32_t v : members.nodes) {
    if (prescribed && prescribed->moves_along(v, motion)) continue;
    RigidStep step;
    step.translation = motion.end_of(v) - motion.start_of(v);
    follow(step);
  }
  return is_consistent ? prescribed : RigidStep();
}

RigidStep ZoneMotion::free_step_of(const ImpactZone& zone, const Motion& motion) const {
  RigidStep free;
  const auto masses = sum<MassSum>(zone, motion, [](const Member& member, MassSum& of_part) {
    of_part.include({member.mass, member.mass * member.start, member.mass * member.displacement});
  });
  if (masses.mass > 0) {
    free.centre = masses.position / masses.mass;
    free.translation = masses.displacement / masses.mass;
  } else if (!zone.bodies.empty()) {
    free.centre = start_of_body(zone.bodies.front(), motion);
  }
  const auto spin = sum<SpinSum>(zone, motion, [&](const Member& member, SpinSum& of_part) {
    const Vector3d arm = member.start - free.centre;
    add_inertia(member.mass, arm, of_part.inertia);
    of_part.momentum += member.mass * arm.cross(member.displacement);
    if (!member.turning) return;
    const Matrix3d inertia = member.turning->inertia();
    of_part.inertia += inertia;
    of_part.momentum += inertia * rotation_over_step(*member.turning, member.turning->rotation);
  });
  Vector3d rotation = rotation_from_momentum(spin.inertia, spin.momentum);
  if (rotation.norm() > settings::rounds::max_zone_rotation)
    rotation *= settings::rounds::max_zone_rotation / rotation.norm();
  for (const int b : zone.bodies) {
    if (!rigid_[b].is_locked()) continue;
    for (int k = 0; k < 3; ++k)
      if (is_axis_locked(rigid_[b], k)) free.translation[k] = 0;
    rotation.setZero();
  }
  free.rotation = rotation_by(rotation);
  return free;
}

bool ZoneMotion::allows(const ImpactZone& zone, const RigidStep& step) const {
  return std::all_of(zone.bodies.begin(), zone.bodies.end(), [&](int b) {
    const RigidMotion& body = rigid_[b];
    if (!body.is_locked()) return true;
    bool allowed = step.rotation.isIdentity();
    for (int k = 0; k < 3; ++k)
      allowed = allowed && (!is_axis_locked(body, k) || step.translation[k] == 0);
    return allowed;
  });
}

void ZoneMotion::move(const ImpactZone& zone, Motion& motion) const {
  std::optional<RigidStep> prescribed = prescribed_step_of(zone.prescribed, motion);
  if (prescribed && !allows(zone, *prescribed)) prescribed = RigidStep();
  const RigidStep velocity_step = prescribed ? *prescribed : free_step_of(zone, motion);
  const RigidStep position_step = zone.held && !prescribed ? RigidStep() : velocity_step;
  const auto move_nodes = [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i)
      move_node(zone.nodes[i], velocity_step, position_step, motion);
  };
  if (zone.nodes.size() > part_size) {
    threads_.parallel_for(zone.nodes.size(), part_size, move_nodes);
  } else {
    move_nodes(0, zone.nodes.size());
  }
  for (const int b : zone.bodies) move_body(b, velocity_step, position_step, motion);
}

void ZoneMotion::move_node(std::int32_t node, const RigidStep& velocity_step,
                           const RigidStep& position_step, Motion& motion) {
  motion.solved[node] = velocity_step(motion.start_of(node));
  if (position_step.stays()) {
    motion.set_end_to_start(node);
  } else {
    motion.split_displacement[node].setZero();
    motion.round_end(node);
  }
}

void ZoneMotion::move_body(int b, const RigidStep& velocity_step, const RigidStep& position_step,
                           Motion& motion) const {
  const RigidMotion& body = motion.rigid()[b];
  RigidSolution& solution = motion.solution_of(body);
  const Vector3d at = start_of_body(b, motion);
  if (turns_with_zone(b)) {
    const Matrix3d predicted_rotation =
        to_double(body.predicted.getBasis()) * to_double(body.start.getBasis()).transpose();
    solution.rotation = rotation_vector(velocity_step.rotation * predicted_rotation.transpose());
  } else {
    solution.rotation = rigid_[b].rotation;
  }
  solution.translation = velocity_step(at) - (end_of_body(b, motion) - rigid_[b].translation);
  solution.split_translation = position_step(at) - velocity_step(at);
  solution.split_rotation.setZero();
  if (position_step.stays()) {
    motion.set_end_to_start(body);
  } else {
    motion.apply_response(body);
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
