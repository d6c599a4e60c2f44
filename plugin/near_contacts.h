// Which of the pairs that come near each other in a step are answered before anything touches.
#pragma once

#include <vector>

#include "contact_rows.h"
#include "distinct_contacts.h"
#include "lazyccd/contact.h"
#include "motion.h"
#include "parallel_for.h"

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
  std::vector<Contact> choose(std::vector<Contact> found, const Motion& motion,
                              const ParallelFor& parallel_for);

  // To be called where the indices of bodies, vertices or faces change.
  void forget() { last_.clear(); }

 private:
  // Of the found ones from `first` to `last` - 1.
  void look_at(const std::vector<Contact>& found, std::size_t first, std::size_t last,
               const Motion& motion);

  ContactRows::Surface surface_;
  std::vector<Contact> last_;  // chosen in the last step
  // By contact that was found: metres where the step begins, and what it binds.
  std::vector<double> gaps_;
  std::vector<Binding> bindings_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
