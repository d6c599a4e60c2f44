// Which of the pairs that come near each other in a step are answered before anything touches.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "response/contact_constraints.h"
#include "detection/contact_reduction.h"
#include "lazyccd/contact.h"
#include "lazyccd/span.h"
#include "motion/motion.h"
#include "util/parallel_for.h"
#include "detection/speculative_kernels.h"
#include "contact/row_list.h"

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

  // `recovery`: as in Options.
  NearContacts(ContactRows::Surface surface, double recovery)
      : surface_(std::move(surface)), recovery_(recovery) {}

  // Of `found`, sorted, those give way that get an answer and come nearer in the step, or lie
  // within reach of their own thickness; one of each that bind nearly the same points.
  // `is_answered` is asked once about each, on several threads. The result is valid until the next
  // call, and as long as `found` is.
  using IsAnswered = std::function<bool(const Contact&)>;
  NearProspects choose(Span<const Contact> found, const IsAnswered& is_answered,
                       const Motion& motion, const ParallelFor& parallel_for);
  // All of them.
  NearProspects all(Span<const Contact> found, const Motion& motion);

  // To be called where the indices of bodies, vertices or faces change.
  void forget() { chosen_.clear(); }

  // What tells a contact from others, in their order.
  using Key = std::array<std::uint64_t, 3>;
  static Key key_of(const Contact& contact);

 private:
  // What contacts ask about their bodies.
  struct Bodies {
    std::int32_t a = -1, b = -1;
    PairSurface surface;
    bool may_have_parts;  // as RigidParts
  };
  Bodies bodies_of(const Contact& contact, const Motion& motion) const;
  // Of as many contacts as there are lanes at most. `bodies`: those of the contact before.
  void foretell(Span<const Contact> contacts, const Motion& motion, Bodies& bodies,
                ProspectLanes& lanes, Prospect* prospects) const;
  // Of the found ones from `first` to `last` - 1.
  void look_at(Span<const Contact> found, std::size_t first, std::size_t last,
               const IsAnswered& is_answered, const Motion& motion);

  // Chosen here, for worlds may be stepped before a constant of this file would be there.
  const ProspectKernels* kernels_ = best_prospect_kernels();
  ContactRows::Surface surface_;
  double recovery_;
  std::vector<Key> chosen_, last_;  // in this step, and in the one before
  // Of those that were found.
  std::vector<Bond> bonds_;
  std::vector<Prospect> prospects_;
  DistinctContacts distinct_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
