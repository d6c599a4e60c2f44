// Keeps the near contacts of bodies that have not moved since they were found.
//
// At rest a detection finds the same pairs in each step. So the contacts of two bodies are kept
// while both stay in place: while all of their vertices start and end a step nearly where they did
// when it was last noticed that the body moves. The constraints follow the present positions; only
// normals and places on the surfaces stay. Other engines keep contacts between steps in the same
// way: Bullet in its persistent manifolds, Jolt in its body pair cache. What happens to other
// bodies makes no difference to the contacts of two.
//
// Nothing is lost. Pairs within 1.1 times the thickness are found, and what stays in place comes
// nearer by less than the rest. And nothing touches as long as vertices have moved relative to each
// other by less than the smallest distance that a detection found.
#pragma once

#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/contact.h"
#include "lazyccd/span.h"
#include "motion/motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class ContactCache {
 public:
  /// Call when indices or pair rules change.
  void forget() { start_.clear(); }
  /// Begins a motion: finds the bodies that stay in place. `found_distances`: by body, the distance
  /// within which all pairs are found, metres. Returns true if all stay: contacts() then hold.
  bool begin(const Motion& motion, Span<const double> found_distances);
  /// After begin() returned false: takes the contacts of a detection for the bodies that moved.
  /// They are sorted. `near_distance`: what any two primitives are apart at the start, at least,
  /// metres; 0 if it is not known.
  void take(const std::vector<Contact>& found, double near_distance, const Motion& motion);
  /// The near contacts of all bodies, sorted.
  Span<const Contact> contacts() const { return contacts_; }
  /// True if it is certain that nothing touches in the motion to its present end, or, with
  /// `at_start`, at its start.
  bool keeps_apart(const Motion& motion, bool at_start) const;

 private:
  std::vector<Contact> contacts_, merged_;
  std::vector<btScalar> start_, end_;  // by body: when it last moved; empty: nothing is kept
  std::vector<char> stays_;            // by body
  std::vector<btScalar> detected_;     // start of the last motion in which all pairs were searched
  double near_distance_ = 0;           // there
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
