// Impact zones, for contacts that impulses do not resolve: nodes and rigid bodies that move as one
// rigid body, and zones of them that are held at the start of the step.
//
// Rigid impact zones: Provot 1997, "Collision and self-collision handling in cloth model dedicated
// to design garments"; Harmon et al. 2008, "Robust Treatment of Simultaneous Collisions". A zone
// conserves the linear and angular momentum of its members. Inside a zone the motion from start to
// end is affine and invertible at all times, so nothing inside it can touch.
//
// Pinned nodes, static and kinematic bodies have infinite mass. They are not ordinary members: they
// are the fixed members of a zone, and prescribe its motion. A zone follows its fixed members if
// these move in the same way, and is held if they do not.
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
  /// Does the same as absorb(), but holds the zones of these contacts at the start of the step, or
  /// lets them follow a kinematic fixed member from there. Their velocities alone are the rigid
  /// ones, so that their momentum is not lost. Once every zone is held, the step is as clean as its
  /// start. `whole_bodies`: also joins all nodes of the bodies in contact. Returns false if there
  /// was nothing to join or hold.
  bool hold(const std::vector<Contact>& contacts, bool whole_bodies, Motion& motion);

  /// Whether nothing can resolve the contact: it is between a kinematic body that moves and a
  /// pinned node that does not move along, and everything movable already follows the body.
  bool is_unresolvable(const Contact& contact, const Motion& motion);
  /// Holds the fixed members of the zones of these contacts at the start of the step, whatever
  /// moves them. This is the last resort. Returns false if all of them were held already.
  bool stop_prescribed(const std::vector<Contact>& contacts, Motion& motion);

  std::int64_t node_count();        ///< soft nodes in zones of several members
  std::int64_t held_count() const;  ///< members of held zones and stopped fixed members

 private:
  struct Zone {
    std::vector<std::int32_t> nodes;
    std::vector<int> bodies;  // dynamic bodies
    bool held = false;
  };
  struct FixedMembers {
    std::set<std::int32_t> nodes;  // pinned
    std::set<int> bodies;          // static and kinematic bodies

    bool empty() const { return nodes.empty() && bodies.empty(); }
    bool include(const FixedMembers& other) const;
    void add(const FixedMembers& other);
  };

  /// Members of a contact: free nodes by vertex, dynamic bodies as soft_count() + index in
  /// Motion::rigid.
  static std::vector<std::int32_t> members_of(const Contact& contact, const Motion& motion);
  static FixedMembers fixed_members_of(const Contact& contact, const Motion& motion);

  /// Whether the members of the contact are in one zone, and the zone has the fixed members of the
  /// contact.
  bool is_merged(const Contact& contact, const Motion& motion);
  /// Joins them so that this holds. Returns false if it held already.
  bool merge(const Contact& contact, const Motion& motion);
  /// The step that the fixed members of a zone prescribe; none without any. If one of them stays or
  /// they differ, the zone stays.
  static std::optional<RigidStep> prescribed_step_of(const FixedMembers& fixed,
                                                     const Motion& motion);
  /// The rigid step with the linear and angular momentum that the members had before any zone.
  RigidStep free_step_of(const Zone& zone, const Motion& motion) const;
  /// Moves one zone.
  void move(const Zone& zone, const FixedMembers& fixed, Motion& motion) const;
  /// Moves all zones, with the fixed members under the present representatives.
  void move_all(Motion& motion);

  DisjointSets zones_;      // elements: soft vertices, then rigid bodies
  std::vector<char> held_;  // by element
  std::map<std::int32_t, FixedMembers> fixed_members_;  // by some member of the zone
  std::vector<Eigen::Vector3d> solved_;                 // Motion::solved before any zone
  std::vector<RigidMotion> rigid_;                      // Motion::rigid before any zone
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
