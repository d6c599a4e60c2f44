// What is left where impulses do not end: nodes and rigid bodies that move as one rigid body, and
// such zones that stay where they were.
//
// Rigid impact zones: Provot 1997, "Collision and self-collision handling in cloth model dedicated
// to design garments"; Harmon et al. 2008, "Robust Treatment of Simultaneous Collisions". A zone
// keeps the linear and angular momentum of what is in it. Inside one, the motion from start to end
// is affine and invertible at all times, so nothing inside it can touch.
//
// What has infinite mass is not a member of a zone but its guide: pinned nodes, static and
// kinematic bodies. A zone follows its guides where they move alike, and stays where they do not.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "lazyccd/contact.h"
#include "motion/motion.h"
#include "util/disjoint_sets.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class ImpactZones {
 public:
  explicit ImpactZones(const Motion& motion);

  // Joins the zones of each contact's members, then moves every zone rigidly from the start of the
  // step with the momenta that its members had when this object was made. False where nothing was
  // left to join.
  bool absorb(const std::vector<Contact>& contacts, Motion& motion);
  // The same, but what these contacts join stays where the step began (or follows a kinematic guide
  // from there). Only its velocity is the rigid one, so that its momentum is not lost. Where every
  // zone is held, the step is as clean as its start. `whole_bodies`: joins all nodes of the bodies
  // in contact. False where nothing was left to join or hold.
  bool hold(const std::vector<Contact>& contacts, bool whole_bodies, Motion& motion);

  // Between a kinematic body that moves and a pinned node that does not go along, while all that
  // could give way follows the body.
  bool is_unresolvable(const Contact& contact, const Motion& motion);
  // What guides these zones stays where the step began, whatever moves it: the last thing that can
  // be done. False where it all does.
  bool stop_prescribed(const std::vector<Contact>& contacts, Motion& motion);

  std::int64_t node_count();  // soft nodes in zones of more than one member
  std::int64_t held_count() const;  // members of held zones, and what was stopped

 private:
  struct Zone {
    std::vector<std::int32_t> nodes;
    std::vector<int> bodies;  // dynamic ones
    bool held = false;
  };
  struct FixedMembers {
    std::set<std::int32_t> nodes;  // pinned
    std::set<int> bodies;          // static and kinematic

    bool empty() const { return nodes.empty() && bodies.empty(); }
    bool include(const FixedMembers& other) const;
    void add(const FixedMembers& other);
  };

  static std::vector<std::int32_t> members_of(const Contact& contact, const Motion& motion);
  static FixedMembers fixed_members_of(const Contact& contact, const Motion& motion);

  // The contact's members are of one zone, with the contact's guides.
  bool is_tied(const Contact& contact, const Motion& motion);
  // Makes it so. False where it was.
  bool tie(const Contact& contact, const Motion& motion);
  void move(const Zone& zone, const FixedMembers& fixed, Motion& motion) const;
  void move_all(Motion& motion);

  DisjointSets zones_;  // of soft vertices, then of rigid bodies
  std::vector<char> held_;                 // by member
  std::map<std::int32_t, FixedMembers> fixed_members_;  // by a member of the zone
  std::vector<Eigen::Vector3d> solved_;    // before any zone
  std::vector<RigidMotion> rigid_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
