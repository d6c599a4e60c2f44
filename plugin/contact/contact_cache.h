// Keeps the near contacts of bodies that have not moved since they were found.
//
// At rest a detection finds the same pairs in each step. So the contacts of two bodies are kept
// while both stay in place. A body stays while all of its vertices start and end a step nearly
// where they did when it last moved. The constraints follow the present positions; only normals and
// places on the surfaces stay. What happens to bodies that are not near makes no difference. Other
// engines keep contacts in the same way: Bullet in its persistent manifolds, Jolt in its body pair
// cache.
//
// Nothing is lost. Pairs within 1.1 times the thickness are found, and what stays in place comes
// nearer by less than the rest. Kept pairs do not touch as long as their vertices have moved
// relative to each other by less than the distance at which the detection found them. A body does
// not stay while something is nearer than a tenth of the distance within which pairs are found: the
// normal might change its side.
#pragma once

#include <vector>

#include "contact/contact_renumbering.h"
#include "lazyccd/bullet/precision.h"
#include "lazyccd/contact.h"
#include "lazyccd/span.h"
#include "motion/motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class ContactCache {
 public:
  void forget() { start_.clear(); }
  /// Call when indices or pair rules change: keeps what is about bodies that did not change.
  /// `coordinate_count`: of all vertices of the new scene.
  void renumber(const ContactRenumbering& numbers, std::size_t coordinate_count);
  /// Begins a motion: finds the bodies that stay in place. `found_distances`: by body, the distance
  /// within which all of its pairs with a constraint are found, metres. Returns true if all stay:
  /// contacts() then hold.
  bool begin(const Motion& motion, Span<const double> found_distances);
  /// The bodies that stay: not 0. By body. A detection may leave out the pairs of two of them, and
  /// of each with itself.
  Span<const char> stays() const { return stays_; }
  /// After begin() returned false: takes the contacts of a detection without those pairs. They are
  /// sorted; other memory takes their place. `near_distances`: as Detector::near_distances() of
  /// that detection.
  void take(std::vector<Contact>&& found, Span<const double> near_distances);
  /// The near contacts of all bodies, sorted.
  Span<const Contact> contacts() const { return contacts_; }
  /// True if it is certain that bodies that stay touch neither each other nor themselves in the
  /// motion to its present end, or, with `at_start`, at its start.
  bool keeps_apart(const Motion& motion, bool at_start) const;

 private:
  // Updates drifts_ before a detection.
  void find_drifts(const Motion& motion);

  std::vector<Contact> contacts_, merged_;
  std::vector<btScalar> start_, end_;   // by body: when it last moved; empty: nothing is kept
  std::vector<double> near_distances_;  // by body: of the detection when it last moved
  // By body that stays: how far, at most, a vertex was from start_ in a detection since then.
  std::vector<double> drifts_;
  std::vector<char> stays_;  // by body
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
