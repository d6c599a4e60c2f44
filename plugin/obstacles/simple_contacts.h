// Contacts of soft bodies with obstacles of simple shapes, met as what they are: balls and capsules
// (RoundContacts), boxes, hulls, cylinders, cones and planes (ConvexContacts), and compounds of
// them.
#pragma once

#include <cstdint>
#include <vector>

#include "contact/pair_surfaces.h"
#include "filter/contact_filter.h"
#include "lazyccd/contact.h"
#include "motion/motion.h"
#include "obstacles/convex_contacts.h"
#include "obstacles/obstacle_pairs.h"
#include "obstacles/round_contacts.h"
#include "obstacles/soft_bounds.h"
#include "scene/step_topology.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class SimpleContacts {
 public:
  /// The arguments must outlive it.
  SimpleContacts(const StepTopology& topology, const Motion& motion, const PairSurfaces& surfaces,
                 const ContactFilter& filter);

  /// Chooses the obstacles that are met here. Call when indices or pair rules change, with the
  /// start of a motion. An obstacle that was given up stays so, unless it or a soft body that may
  /// meet it is new or changed. `new_index`: by old body; -1 if it is gone or changed. Empty: all
  /// are new.
  void set_topology(const std::vector<std::int32_t>& new_index);
  /// Meets no obstacle until the next set_topology().
  void clear() {
    set_obstacles({});
    given_up_.clear();
  }
  bool any() const { return !obstacles_.empty(); }
  /// Changes the filters of a detector, such that it leaves out the pairs of these obstacles.
  void leave_out(std::vector<Body>& filters) const;

  /// Sets `contacts` to what comes within `separation`, metres, of these obstacles in the motion,
  /// sorted. Call once in each motion, first. Returns false if it gives up an obstacle: the
  /// detector needs new filters then. That is one in which a vertex starts, or one that was not
  /// clear in many motions in succession. Balls and capsules alone are not given up.
  bool find_near(double separation, std::vector<Contact>& contacts);
  /// True if it is certain that no soft body touches the triangles of these obstacles in the motion
  /// to its present end, or, with `at_start`, at its start. What an anchor holds to a ball or a
  /// capsule does not count: its contacts are ignored.
  bool are_clear(bool at_start);

 private:
  struct Obstacle {
    ObstaclePairs pairs;
    bool may_be_given_up;
    bool was_clear = true;    // in the last motion
    int unclear_motions = 0;  // in succession
  };

  bool may_be_met(const ObstaclePairs& obstacle) const;
  void set_obstacles(const std::vector<ObstaclePairs>& obstacles);
  void give_up(std::int32_t body);

  const StepTopology& topology_;
  const Motion& motion_;
  SoftBounds soft_bounds_;
  RoundContacts round_;
  ConvexContacts convex_;
  std::vector<Obstacle> obstacles_;
  std::vector<ObstaclePairs> given_up_;
  std::vector<Contact> of_convex_;      // scratch memory
  std::vector<std::int32_t> at_fault_;  // scratch memory: bodies that are given up or not clear
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
