// Impact zones, for contacts that impulses do not resolve: nodes and rigid bodies that move as one
// rigid body, and zones of them that are held at the start of the step.
//
// Rigid impact zones: Provot 1997, "Collision and self-collision handling in cloth model dedicated
// to design garments"; Harmon et al. 2008, "Robust Treatment of Simultaneous Collisions". A zone
// conserves the linear and angular momentum of its members. Inside a zone the motion from start to
// end is affine and invertible at all times, so nothing inside it can touch.
//
// Pinned nodes and static or kinematic bodies have infinite mass. A zone that contains some of them
// takes over their motion if they all move alike; otherwise it is held. They are the prescribed
// members of the zone. Links of multibodies count as such too: joints do not let them join a zone.
//
// A dynamic body that touches nothing in its zone, and to which one node of the zone is anchored,
// is a mass at that node. It does not turn with the zone, for an anchor pulls and does not turn.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "lazyccd/contact.h"
#include "motion/motion.h"
#include "motion/rigid_step.h"
#include "util/disjoint_sets.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// The zones of one step.
class ImpactZones {
 public:
  /// Starts without zones. The momenta that zones conserve are those of the present solved motion.
  explicit ImpactZones(const Motion& motion);

  /// Joins the zones of each contact's members. Then moves every zone rigidly from the start of the
  /// step with the momenta that its members had when this object was constructed. Returns false if
  /// there was nothing to join.
  bool absorb(const std::vector<Contact>& contacts, Motion& motion);
  /// Does the same as absorb(), but holds the zones of these contacts: positions stay at the start
  /// of the step, or follow a kinematic prescribed member from there. Velocities still become those
  /// of the rigid zone, so momentum is kept. Once every zone is held, no contact is left that was
  /// not there at the start. `whole_bodies`: also joins and holds all nodes of the bodies in
  /// contact. Returns false if there was nothing to join or hold.
  bool hold(const std::vector<Contact>& contacts, bool whole_bodies, Motion& motion);

  /// Whether nothing can resolve the contact: it is between a kinematic body that moves and a
  /// pinned node that does not move along, and everything movable already follows the body.
  bool is_unresolvable(const Contact& contact, const Motion& motion);
  /// Holds the prescribed members of the zones of these contacts at the start of the step, whatever
  /// moves them. Nothing else is left to try then. Returns false if all of them were held already.
  bool stop_prescribed(const std::vector<Contact>& contacts, Motion& motion);

  std::int64_t node_count();  ///< soft nodes in zones of several members
  /// Members that hold() and stop_prescribed() flagged: those of the contacts, or of whole bodies.
  /// The other members of a held zone do not count.
  std::int64_t held_count() const;

 private:
  struct Zone {
    std::vector<std::int32_t> nodes;
    std::vector<int> bodies;  // dynamic bodies
    bool held = false;
  };
  struct PrescribedMembers {
    std::set<std::int32_t> nodes;  // pinned
    std::set<int> bodies;          // static and kinematic bodies

    bool empty() const { return nodes.empty() && bodies.empty(); }
    bool include(const PrescribedMembers& other) const;
    void add(const PrescribedMembers& other);
  };

  /// Members of a contact: free nodes by vertex, dynamic bodies as soft_count() + index in
  /// Motion::rigid.
  static std::vector<std::int32_t> members_of(const Contact& contact, const Motion& motion);
  static PrescribedMembers prescribed_members_of(const Contact& contact, const Motion& motion);

  /// Notes by which vertices the dynamic bodies of the contact are in zones. Returns false if all
  /// of it was known.
  bool note_vertices(const Contact& contact, const Motion& motion);
  /// Where a body is in its zone, metres: its centre, or the vertex that is anchored to it if it is
  /// a mass at that vertex. At the start of the step, and at its end before any zone.
  Eigen::Vector3d start_of_body(int body, const Motion& motion) const;
  Eigen::Vector3d end_of_body(int body, const Motion& motion) const;
  bool turns_with_zone(int body) const { return zone_vertex_[body] < 0; }

  /// Whether the members of the contact are in one zone, and the zone has the prescribed members of
  /// the contact.
  bool is_merged(const Contact& contact, const Motion& motion);
  /// Joins them so that this holds. Returns false if it held already.
  bool merge(const Contact& contact, const Motion& motion);
  /// The step that the prescribed members of a zone make; none without any. If one of them stays or
  /// they differ, the zone stays.
  static std::optional<RigidStep> prescribed_step_of(const PrescribedMembers& members,
                                                     const Motion& motion);
  /// The rigid step with the linear and angular momentum that the members had before any zone.
  RigidStep free_step_of(const Zone& zone, const Motion& motion) const;
  /// Moves one zone.
  void move(const Zone& zone, const PrescribedMembers& members, Motion& motion) const;
  /// Moves all zones, with the prescribed members under the present representatives.
  void move_all(Motion& motion);

  DisjointSets zones_;      // elements: soft vertices, then rigid bodies
  std::vector<char> held_;  // by element
  /// By rigid body: the anchored vertex by which alone it is in a zone, or one of these two.
  static constexpr std::int32_t turns = -1, in_no_zone = -2;
  std::vector<std::int32_t> zone_vertex_;
  /// Key: the representative of the zone when they were added; move_all() re-keys to the present
  /// one.
  std::map<std::int32_t, PrescribedMembers> prescribed_members_;
  std::vector<Eigen::Vector3d> solved_;  // Motion::solved before any zone
  std::vector<RigidMotion> rigid_;       // Motion::rigid before any zone
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
