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
#include <vector>

#include "lazyccd/contact.h"
#include "lazyccd/threads.h"
#include "motion/motion.h"
#include "response/zone_motion.h"
#include "util/disjoint_sets.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// The zones of one step.
class ImpactZones {
 public:
  /// Starts without zones. The momenta that zones conserve are those of the present solved motion.
  explicit ImpactZones(const Motion& motion, const Threads& threads = Threads(1));

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

  std::int64_t node_count() const;  ///< soft nodes in zones
  /// Members that hold() and stop_prescribed() flagged: those of the contacts, or of whole bodies.
  /// The other members of a held zone do not count.
  std::int64_t held_count() const;
  /// Whether a member is one of those: a soft vertex, or soft_count() + index in Motion::rigid.
  bool is_held(std::int32_t member) const { return held_[member] != 0; }
  /// All zones, in the order of their first members.
  std::vector<ImpactZone> list(const Motion& motion);

 private:
  /// Members of a contact: free nodes by vertex, dynamic bodies as soft_count() + index in
  /// Motion::rigid.
  static std::vector<std::int32_t> members_of(const Contact& contact, const Motion& motion);
  static PrescribedMembers prescribed_members_of(const Contact& contact, const Motion& motion);

  /// Whether the members of the contact are in one zone, and the zone has the prescribed members of
  /// the contact.
  bool is_merged(const Contact& contact, const Motion& motion);
  /// Joins them so that this holds. Returns false if it held already.
  bool merge(const Contact& contact, const Motion& motion);
  /// Joins two members. Returns false if they were in one zone before.
  bool join(std::int32_t a, std::int32_t b);
  /// Returns false if the member was held before.
  bool hold(std::int32_t member);

  std::int32_t soft_count_;            // number of soft vertices
  DisjointSets zones_;                 // elements: soft vertices, then rigid bodies
  std::vector<char> held_, in_zone_;   // by element
  std::vector<std::int32_t> members_;  // elements in zones, in any order
  /// Key: the representative of the zone when they were added; list() re-keys to the present one.
  std::map<std::int32_t, PrescribedMembers> prescribed_members_;
  ZoneMotion zone_motion_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
