// Which of the pairs that come near each other in a step are answered before anything touches.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <vector>

#include "contact/pair_surfaces.h"
#include "detection/contact_filter.h"
#include "detection/contact_reduction.h"
#include "lazyccd/contact.h"
#include "lazyccd/span.h"
#include "motion/motion.h"
#include "lazyccd/threads.h"
#include "detection/speculative_kernels.h"
#include "contact/row_list.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class SpeculativeContacts {
 public:
  // Pairs are near up to this many thicknesses: what rests lies at one, and would be near in one
  // step and not in the next.
  static constexpr double reach = 1.1;

  // Of a vertex, for Topology: no less than reach of the thickness there can be within a body. What
  // that is depends on points that are rounded.
  static float self_separation(std::int32_t vertex, const Motion& motion) {
    constexpr double rounding = 1.001;
    return static_cast<float>(rounding * reach * 0.5 * motion.shortest_edge[vertex]);
  }

  // The surfaces must outlive it. `position_correction`: as in SolverOptions.
  SpeculativeContacts(const PairSurfaces& surfaces, double position_correction)
      : surfaces_(surfaces), position_correction_(position_correction) {}

  // Of `found`, sorted, those give way that get an answer and come nearer in the step, or lie
  // within reach of their own thickness; one of each that bind nearly the same points.
  // The filter is asked once about each, on several threads. The result is valid until the next
  // call, and as long as `found` is.
  SpeculativePairs choose(Span<const Contact> found, const ContactFilter& filter,
                          const Motion& motion, const Threads& threads);
  // Of the last choose(): the filter lets any of the pairs have an answer.
  bool any_answered() const { return any_answered_.load(std::memory_order_relaxed); }
  // All of them.
  SpeculativePairs all(Span<const Contact> found, const Motion& motion);

  // To be called where the indices of bodies, vertices or faces change.
  void forget() { selected_.clear(); }

  // What tells a contact from others, in their order.
  using PairKey = std::array<std::uint64_t, 3>;
  static PairKey pair_key_of(const Contact& contact);

 private:
  // What contacts ask about their bodies.
  struct Bodies {
    std::int32_t a = -1, b = -1;
    PairSurface surface;
    bool may_have_parts;  // as RigidTerms
  };
  Bodies bodies_of(const Contact& contact, const Motion& motion) const;
  // Of as many contacts as there are lanes at most. `bodies`: those of the contact before.
  void evaluate(Span<const Contact> contacts, const Motion& motion, Bodies& bodies,
                SpeculativeLanes& lanes, SpeculativeContact* speculative) const;
  // Of the found ones from `first` to `last` - 1.
  void evaluate_range(Span<const Contact> found, std::size_t first, std::size_t last,
               const ContactFilter& filter, const Motion& motion);

  // Chosen here, for worlds may be stepped before a constant of this file would be there.
  const SpeculativeKernels* kernels_ = best_speculative_kernels();
  const PairSurfaces& surfaces_;
  double position_correction_;
  std::vector<PairKey> selected_, last_;  // in this step, and in the one before
  // Of those that were found.
  std::vector<ReductionEntry> entries_;
  std::vector<SpeculativeContact> speculative_contacts_;
  ContactReduction reduction_;
  std::atomic<bool> any_answered_{false};  // relaxed: read after the end of the parallel loop
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
