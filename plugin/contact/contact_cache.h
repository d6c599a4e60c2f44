// Keeps the near contacts of bodies that have not moved since they were found.
//
// At rest a detection finds the same pairs in each step. So the contacts of two bodies are kept
// while both stay in place. A body stays while all of its vertices start and end a step nearly
// where they did when it last moved. The constraints follow the present positions; only normals and
// places on the surfaces stay. What happens to other bodies makes no difference, as long as the
// indices stay. Other engines keep contacts in the same way: Bullet in its persistent manifolds,
// Jolt in its body pair cache.
//
// Nothing is lost. Pairs within 1.1 times the thickness are found, and what stays in place comes
// nearer by less than the rest. Nothing touches as long as vertices have moved relative to each
// other by less than the smallest distance that a detection found. A body does not stay while
// something is so near to it that the normal may change its side.
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
  /// within which all of its pairs with a constraint are found, metres. Returns true if all stay:
  /// contacts() then hold.
  bool begin(const Motion& motion, Span<const double> found_distances);
  /// After begin() returned false: takes the contacts of a detection for the bodies that moved.
  /// They are sorted. `near_distance`: what any two primitives are apart at the start, at least,
  /// metres; negative if it is not known.
  void take(const std::vector<Contact>& found, double near_distance, const Motion& motion);
  /// The near contacts of all bodies, sorted.
  Span<const Contact> contacts() const { return contacts_; }
  /// True if it is certain that nothing touches in the motion to its present end, or, with
  /// `at_start`, at its start.
  bool keeps_apart(const Motion& motion, bool at_start) const;

 private:
  // Whether the contact is nearly closed at the start of the motion.
  bool is_close(const Contact& contact, const Motion& motion) const;

  std::vector<Contact> contacts_, merged_;
  std::vector<btScalar> start_, end_;  // by body: when it last moved; empty: nothing is kept
  std::vector<double> distances_;      // by body: the last found_distances
  std::vector<char> stays_;            // by body
  std::vector<char> is_close_;         // by body: to something, at the last detection
  std::vector<btScalar> detected_;     // start of the last motion in which all pairs were searched
  double near_distance_ = -1;          // there
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
