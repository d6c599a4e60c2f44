// Selects the pairs of near primitives that get a constraint before anything touches.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <utility>
#include <vector>

#include "contact/contact_renumbering.h"
#include "contact/last_impulses.h"
#include "contact/near_contacts.h"
#include "contact/pair_surfaces.h"
#include "detection/contact_reduction.h"
#include "detection/hidden_contacts.h"
#include "detection/row_estimate_kernels.h"
#include "filter/contact_filter.h"
#include "lazyccd/contact.h"
#include "lazyccd/span.h"
#include "lazyccd/threads.h"
#include "motion/motion.h"
#include "settings.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class NearContactSelector {
 public:
  /// Topology::self_separation of a vertex: at least distance_factor times the largest thickness
  /// that is possible within one body. The factor 1.001 covers rounding, because that thickness
  /// depends on rounded contact points.
  static float self_separation(std::int32_t vertex, const Motion& motion) {
    constexpr double rounding = 1.001;
    return static_cast<float>(rounding * settings::detection::distance_factor *
                              settings::row::max_thickness_of_edge *
                              motion.shortest_edge()[vertex]);
  }

  /// `surfaces` must outlive this object. `position_correction`: as in SolverOptions.
  NearContactSelector(const PairSurfaces& surfaces, double position_correction,
                      HiddenContacts::StopEachOther stop_each_other)
      : surfaces_(surfaces),
        position_correction_(position_correction),
        hidden_(std::move(stop_each_other)) {}

  /// Selects pairs from `found`, which is sorted. A pair is selected if the filter lets it act, and
  /// if it approaches in the step or lies within distance_factor of its own thickness. If several
  /// pairs constrain nearly the same points, it selects one, and none of those that others hide.
  /// All other pairs get can_act = false. Calls the filter once for each pair, on several threads.
  /// The result is valid until the next call, and as long as `found` is.
  NearContacts select(Span<const Contact> found, const ContactFilter& filter, const Motion& motion,
                      const Threads& threads);
  /// True if any pair of the last select() acts, rests or passes.
  bool any_responds() const { return any_responds_.load(std::memory_order_relaxed); }
  /// Evaluates all pairs and selects them.
  NearContacts evaluate_all(Span<const Contact> found, const Motion& motion);

  /// Call when nothing was near.
  void forget() { selected_.clear(); }
  /// Call when the indices of bodies, vertices or faces change: keeps the pairs of bodies that did
  /// not change.
  void renumber(const ContactRenumbering& numbers);
  /// These pairs, which are sorted, count as selected in the last step too.
  void remember(const std::vector<LastImpulses::Pair>& pairs);

  /// Identifies a contact. Keys have the same order as contacts.
  using PairKey = std::array<std::uint64_t, 3>;
  static PairKey pair_key_of(const Contact& contact);

 private:
  /// Data of the two bodies of a contact, for evaluate().
  struct BodyPairData {
    std::int32_t a = -1, b = -1;
    PairSurface surface;
    bool may_have_rigid_terms;  ///< a contact may have RigidTerms
  };
  BodyPairData data_of(const Contact& contact, const Motion& motion) const;
  /// Evaluates at most RowEstimateLanes::count contacts. `bodies`: data of the previous contact's
  /// bodies; read again only when the bodies change.
  void evaluate(Span<const Contact> contacts, const Motion& motion, BodyPairData& bodies,
                RowEstimateLanes& lanes, RowEstimate* estimates) const;
  /// Evaluates found[first] to found[last - 1], filters them and makes their keys.
  void evaluate_range(Span<const Contact> found, std::size_t first, std::size_t last,
                      const ContactFilter& filter, const Motion& motion);
  /// Deselects the pairs that were dropped, and sets selected_ to the others.
  void take_selected(Span<const Contact> found, const Threads& threads);

  /// A member and not a namespace-scope constant, because worlds may be stepped before the
  /// constants of this file are initialised.
  const RowEstimateKernels* kernels_ = best_row_estimate_kernels();
  const PairSurfaces& surfaces_;
  double position_correction_;
  std::vector<PairKey> selected_, previously_selected_;  ///< in this step, and in the one before
  /// One element for each pair in `found`.
  std::vector<ReductionEntry> entries_;
  std::vector<RowEstimate> estimates_;
  std::vector<std::size_t> first_of_part_;  ///< scratch memory of take_selected()
  ContactReduction reduction_;
  HiddenContacts hidden_;
  std::atomic<bool> any_responds_{false};  // relaxed: read after the end of the parallel loop
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
