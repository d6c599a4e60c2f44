// How impact zones move: every zone as one rigid body, with the linear and angular momentum of its
// members.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <vector>

#include "lazyccd/contact.h"
#include "lazyccd/threads.h"
#include "motion/motion.h"
#include "motion/rigid_step.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Members of infinite mass: they give a zone their motion.
struct PrescribedMembers {
  std::set<std::int32_t> nodes;  ///< pinned soft vertices
  std::set<int> bodies;          ///< static and kinematic bodies, by index in Motion::rigid

  bool empty() const { return nodes.empty() && bodies.empty(); }
  bool include(const PrescribedMembers& other) const;
  void add(const PrescribedMembers& other);
};

struct ImpactZone {
  std::vector<std::int32_t> nodes;  ///< free soft vertices
  std::vector<int> bodies;          ///< dynamic bodies, by index in Motion::rigid
  PrescribedMembers prescribed;
  bool held = false;  ///< stays at the start of the step
};

/// Moves the zones of one step.
class ZoneMotion {
 public:
  /// The momenta that zones conserve are those of the present solved motion, which is copied.
  ZoneMotion(const Motion& motion, const Threads& threads);

  /// Notes by which vertices the dynamic bodies of the contact are in zones. Returns false if all
  /// of it was known.
  bool note_vertices(const Contact& contact, const Motion& motion);
  /// Sets the ends of all members of the zones. No two zones share a member.
  void move(const std::vector<ImpactZone>& zones, Motion& motion) const;

 private:
  struct Member;

  /// Where a body is in its zone, metres: its centre, or the vertex that is anchored to it if it is
  /// a mass at that vertex. At the start of the step, and at its end before any zone.
  Vector3d start_of_body(int body, const Motion& motion) const;
  Vector3d end_of_body(int body, const Motion& motion) const;
  bool turns_with_zone(int body) const { return zone_vertex_[body] < 0; }
  Member member_of(const ImpactZone& zone, std::size_t i, const Motion& motion) const;
  /// Sums over the members: each(Member, Sum&).
  template <class Sum, class Each>
  Sum sum(const ImpactZone& zone, const Motion& motion, const Each& each) const;

  /// The step that the prescribed members of a zone make; none without any. If one of them stays or
  /// they differ, the zone stays.
  static std::optional<RigidStep> prescribed_step_of(const PrescribedMembers& members,
                                                     const Motion& motion);
  /// Whether all bodies of a zone can make a step: none moves along, or turns about, a locked axis.
  bool allows(const ImpactZone& zone, const RigidStep& step) const;
  /// The rigid step with the linear and angular momentum that the members had before any zone.
  RigidStep free_step_of(const ImpactZone& zone, const Motion& motion) const;
  void move(const ImpactZone& zone, Motion& motion) const;
  static void move_node(std::int32_t node, const RigidStep& velocity_step,
                        const RigidStep& position_step, Motion& motion);
  void move_body(int body, const RigidStep& velocity_step, const RigidStep& position_step,
                 Motion& motion) const;

  Threads threads_;
  /// By rigid body: the anchored vertex by which alone it is in a zone, or one of these two.
  static constexpr std::int32_t turns = -1, in_no_zone = -2;
  std::vector<std::int32_t> zone_vertex_;
  std::vector<Vector3d> solved_;    // Motion::solved before any zone
  std::vector<RigidMotion> rigid_;  // Motion::rigid before any zone
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
