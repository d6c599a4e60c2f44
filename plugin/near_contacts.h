// Which of the pairs that come near each other in a step are answered before anything touches.
#pragma once

#include <vector>

#include "contact_rows.h"
#include "lazyccd/contact.h"
#include "motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class NearContacts {
 public:
  // Pairs are near up to this many thicknesses: what rests lies at one, and would be near in one
  // step and not in the next.
  static constexpr double reach = 1.1;

  explicit NearContacts(ContactRows::Surface surface) : surface_(std::move(surface)) {}

  // Of `found`, sorted, those that come nearer in the step, or lie within reach of their own
  // thickness; one of each that bind nearly the same points.
  std::vector<Contact> choose(std::vector<Contact> found, const Motion& motion);

  // To be called where the indices of bodies, vertices or faces change.
  void forget() { last_.clear(); }

 private:
  ContactRows::Surface surface_;
  std::vector<Contact> last_;  // chosen in the last step
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
