#include "detection/near_contact_selector.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <numeric>

#include "contact/contact_checks.h"
#include "lazyccd/debug/assert.h"
#include "lazyccd/query.h"
#include "settings.h"
#include "util/profile.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

constexpr std::size_t lane_count = RowEstimateLanes::count;

// True if the pair comes within `distance` metres at any time of the step.
bool comes_within(double distance, const Contact& contact, const Motion& motion) {
  QueryPoints points;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto at = 3 * static_cast<std::size_t>(contact.vertices[i]);
    std::copy_n(&motion.start()[at], 3, points[i].begin());
    std::copy_n(&motion.end[at], 3, points[4 + i].begin());
  }
  return decide_within(contact.kind, points, distance).hit;
}

// True for pairs that need no constraint: pairs that touch at the start, because they have no
// normal yet; and pairs that stay further apart than distance_factor times their own thickness.
// Within one body, a pair that starts further apart is irrelevant in any case: neighbours lie like
// that, and the body itself handles what presses them together. `gap_dot`: as in RowEstimateLanes.
bool is_irrelevant(const Contact& contact, double thickness, double start_gap, double gap_dot,
                   const Motion& motion) {
  if (contact.toi > 0) return false;
  const double near_distance = settings::detection::distance_factor * thickness;
  if (start_gap <= near_distance) return start_gap < settings::detection::touching_gap * thickness;
  if (contact.body_a == contact.body_b) return true;
  return gap_dot > near_distance * start_gap || !comes_within(near_distance, contact, motion);
}

}  // namespace

NearContactSelector::PairKey NearContactSelector::pair_key_of(const Contact& contact) {
  const auto pack = [](std::int32_t a, std::int32_t b) {
    return static_cast<std::uint64_t>(a) << 32 | static_cast<std::uint32_t>(b);
  };
  return {pack(contact.body_a, contact.body_b),
          pack(static_cast<std::int32_t>(contact.kind), contact.primitive_a),
          static_cast<std::uint64_t>(contact.primitive_b)};
}

NearContactSelector::BodyPairData NearContactSelector::data_of(const Contact& contact,
                                                               const Motion& motion) const {
  const auto is_movable = [&](std::int32_t body) {
    const int rigid = motion.rigid_of_body()[body];
    return rigid >= 0 && motion.rigid()[rigid].is_movable();
  };
  return {contact.body_a, contact.body_b, surfaces_.of(contact.body_a, contact.body_b),
          !motion.anchored().empty() || is_movable(contact.body_a) || is_movable(contact.body_b)};
}

void NearContactSelector::evaluate(Span<const Contact> contacts, const Motion& motion,
                                   BodyPairData& bodies, RowEstimateLanes& lanes,
                                   RowEstimate* estimates) const {
  std::array<bool, lane_count> may_have_rigid_terms;
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    if (contacts[k].body_a != bodies.a || contacts[k].body_b != bodies.b)
      bodies = data_of(contacts[k], motion);
    lanes.thickness[k] = bodies.surface.thickness;
    may_have_rigid_terms[k] = bodies.may_have_rigid_terms;
  }
  const RowEstimateInput<btScalar> arrays = {
      motion.start().data(),        motion.end.data(),
      motion.inverse_mass().data(), motion.shortest_edge().data(),
      motion.soft_count(),          corrected_share(position_correction_, motion.dt())};
  kernels_->find(arrays, contacts.data(), static_cast<int>(contacts.size()), lanes);
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    estimates[k] = {lanes.move_squared[k], lanes.need[k], lanes.normal_mass[k],
                    lanes.can_act[k] != 0, lanes.may_need_split[k] != 0};
    if (!may_have_rigid_terms[k]) continue;
    ContactRow row;
    make_row(contacts[k], lanes.thickness[k], position_correction_, motion, row);
    estimates[k].normal_mass = row.normal_mass;
    estimates[k].can_act = row.can_act;
  }
}

void NearContactSelector::evaluate_range(Span<const Contact> found, std::size_t first,
                                         std::size_t last, const ContactFilter& filter,
                                         const Motion& motion) {
  BodyPairData bodies;
  RowEstimateLanes lanes = {};
  bool any_responds = false;
  auto previous = std::lower_bound(previously_selected_.begin(), previously_selected_.end(),
                                   pair_key_of(found[first]));
  for (std::size_t i = first; i < last; ++i) {
    const std::size_t lane = (i - first) % lane_count;
    if (lane == 0) {
      const Span<const Contact> batch(&found[i], std::min(lane_count, last - i));
      evaluate(batch, motion, bodies, lanes, &estimates_[i]);
    }
    const Contact& contact = found[i];
    ReductionEntry& entry = entries_[i];
    entry.key.kind = ConstraintKey::none;
    const ContactFilter::Verdict verdict = filter.verdict(contact);
    if (verdict == ContactFilter::Verdict::report_only || verdict == ContactFilter::Verdict::ignore)
      continue;
    any_responds = true;
    if (verdict != ContactFilter::Verdict::act) continue;
    entry.gap = std::sqrt(lanes.gap_squared[lane]);
    if (is_irrelevant(contact, lanes.thickness[lane], entry.gap, lanes.gap_dot[lane], motion))
      continue;
    make_constraint_key(contact, entry.key);
    // Prefer the pair that was selected in the last step, unless another one is clearly nearer.
    const PairKey key = pair_key_of(contact);
    while (previous != previously_selected_.end() && *previous < key) ++previous;
    if (previous != previously_selected_.end() && !(key < *previous))
      entry.gap *= settings::detection::hysteresis;
  }
  if (any_responds) any_responds_.store(true, std::memory_order_relaxed);
}

void NearContactSelector::renumber(const ContactRenumbering& numbers) {
  std::vector<PairKey> kept;
  for (const PairKey& key : selected_) {
    Contact contact = {};
    contact.body_a = static_cast<std::int32_t>(key[0] >> 32);
    contact.body_b = static_cast<std::int32_t>(key[0]);
    contact.kind = static_cast<ContactKind>(key[1] >> 32);
    contact.primitive_a = static_cast<std::int32_t>(key[1]);
    contact.primitive_b = static_cast<std::int32_t>(key[2]);
    if (numbers.renumber(contact)) kept.push_back(pair_key_of(contact));
  }
  selected_.swap(kept);
}

void NearContactSelector::remember(const std::vector<LastImpulses::Pair>& pairs) {
  std::vector<PairKey> keys, both;
  for (const LastImpulses::Pair& pair : pairs) keys.push_back(pair_key_of(pair.contact));
  std::set_union(selected_.begin(), selected_.end(), keys.begin(), keys.end(),
                 std::back_inserter(both));
  selected_.swap(both);
}

NearContacts NearContactSelector::select(Span<const Contact> found, const ContactFilter& filter,
                                         const Motion& motion, const Threads& threads) {
  LAZYCCD_BT_PROFILE("select");
  LAZYCCD_ASSERT(are_sorted(found), "contacts to select from are sorted, none twice");
  LAZYCCD_ASSERT(std::is_sorted(selected_.begin(), selected_.end()),
                 "pairs that were selected in the last step are sorted");
  previously_selected_.swap(selected_);
  entries_.resize(found.size());
  estimates_.resize(found.size());
  any_responds_.store(false, std::memory_order_relaxed);
  constexpr std::size_t grain = 512;  // pairs; more work than it costs to distribute them
  threads.parallel_for(found.size(), grain, [&](std::size_t first, std::size_t last) {
    evaluate_range(found, first, last, filter, motion);
  });
  reduction_.reduce(entries_, threads);
  hidden_.drop({found, estimates_}, motion, threads, entries_);
  take_selected(found, threads);
  return {found, estimates_};
}

void NearContactSelector::take_selected(Span<const Contact> found, const Threads& threads) {
  constexpr std::size_t grain = 2048;  // more work than it costs to distribute it
  const std::size_t parts = (found.size() + grain - 1) / grain;
  first_of_part_.assign(parts + 1, 0);
  const auto for_each_part = [&](const auto& each) {
    const auto range = [&](std::size_t first, std::size_t last) {
      for (std::size_t part = first; part < last; ++part)
        each(part, part * grain, std::min((part + 1) * grain, found.size()));
    };
    threads.parallel_for(parts, 1, std::cref(range));
  };
  const auto is_selected = [this](std::size_t i) {
    return entries_[i].key.kind != ConstraintKey::none;
  };
  for_each_part([&](std::size_t part, std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      estimates_[i].can_act = estimates_[i].can_act && is_selected(i);
      first_of_part_[part + 1] += is_selected(i);
    }
  });
  std::partial_sum(first_of_part_.begin(), first_of_part_.end(), first_of_part_.begin());
  selected_.resize(first_of_part_.back());
  for_each_part([&](std::size_t part, std::size_t first, std::size_t last) {
    std::size_t place = first_of_part_[part];
    for (std::size_t i = first; i < last; ++i)
      if (is_selected(i)) selected_[place++] = pair_key_of(found[i]);
  });
}

NearContacts NearContactSelector::evaluate_all(Span<const Contact> found, const Motion& motion) {
  BodyPairData bodies;
  RowEstimateLanes lanes = {};
  estimates_.resize(found.size());
  for (std::size_t i = 0; i < found.size(); i += lane_count) {
    const Span<const Contact> batch(&found[i], std::min(lane_count, found.size() - i));
    evaluate(batch, motion, bodies, lanes, &estimates_[i]);
  }
  return {found, estimates_};
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
