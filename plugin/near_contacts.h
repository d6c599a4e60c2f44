// Which of the pairs that come near each other in a step are answered before anything touches.
#pragma once

#include <functional>
#include <vector>

#include "contact_rows.h"
#include "distinct_contacts.h"
#include "lazyccd/contact.h"
#include "lazyccd/span.h"
#include "motion.h"
#include "parallel_for.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class NearContacts {
 public:
  // Pairs are near up to this many thicknesses: what rests lies at one, and would be near in one
  // step and not in the next.
  static constexpr double reach = 1.1;

  // Of a vertex, for Topology: no less than reach of the thickness there can be within a body. What
  // that is depends on points that are rounded.
  static float self_reach(std::int32_t vertex, const Motion& motion) {
    constexpr double rounding = 1.001;
    return static_cast<float>(rounding * reach * 0.5 * motion.reach[vertex]);
  }

  explicit NearContacts(ContactRows::Surface surface) : surface_(std::move(surface)) {}

  // Of `found`, sorted, those that get an answer and come nearer in the step, or lie within reach
  // of their own thickness; one of each that bind nearly the same points. `is_answered` is asked
  // once about each, on several threads. The result is valid until the next call.
  using IsAnswered = std::function<bool(const Contact&)>;
  const std::vector<Contact>& choose(Span<const Contact> found, const IsAnswered& is_answered,
                                     const Motion& motion, const ParallelFor& parallel_for);

  // To be called where the indices of bodies, vertices or faces change.
  void forget() { chosen_.clear(); }

 private:
  // Of the found ones from `first` to `last` - 1.
  void look_at(Span<const Contact> found, std::size_t first, std::size_t last,
               const IsAnswered& is_answered, const Motion& motion);

  ContactRows::Surface surface_;
  std::vector<Contact> chosen_, last_;  // in this step, and in the one before
  std::vector<Bond> bonds_;             // of those that were found
  DistinctContacts distinct_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
