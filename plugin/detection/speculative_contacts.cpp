#include "detection/speculative_contacts.h"

#include <algorithm>
#include <cmath>

#include "lazyccd/query.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

constexpr std::size_t lane_count = ProspectLanes::count;

// Of pairs that bind the same points, another is nearer where its gap is less than this part.
constexpr double as_near = 0.999;

bool comes_within(double distance, const Contact& contact, const Motion& motion) {
  QueryPoints points;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto at = 3 * static_cast<std::size_t>(contact.vertices[i]);
    std::copy_n(&motion.start[at], 3, points[i].begin());
    std::copy_n(&motion.end[at], 3, points[4 + i].begin());
  }
  return decide_within(contact.kind, points, distance).hit;
}

// Pairs that touch, which have no normal yet; and those that stay further apart than their own
// thickness. Of one body, neighbours lie so, and what presses them together is their own matter.
// `gap_kept`: as ProspectLanes has it.
bool says_nothing(const Contact& contact, double thickness, double start_gap, double gap_kept,
                  const Motion& motion) {
  if (contact.toi > 0) return false;
  const double far = NearContacts::reach * thickness;
  if (start_gap <= far) return start_gap < 1e-6 * thickness;
  if (contact.body_a == contact.body_b) return true;
  return gap_kept > far * start_gap || !comes_within(far, contact, motion);
}

}  // namespace

NearContacts::Key NearContacts::key_of(const Contact& contact) {
  const auto both = [](std::int32_t a, std::int32_t b) {
    return static_cast<std::uint64_t>(a) << 32 | static_cast<std::uint32_t>(b);
  };
  return {both(contact.body_a, contact.body_b),
          both(static_cast<std::int32_t>(contact.kind), contact.primitive_a),
          static_cast<std::uint64_t>(contact.primitive_b)};
}

NearContacts::Bodies NearContacts::bodies_of(const Contact& contact, const Motion& motion) const {
  const auto is_dynamic = [&](std::int32_t body) {
    const int rigid = motion.rigid_of_body[body];
    return rigid >= 0 && motion.rigid[rigid].is_dynamic();
  };
  return {contact.body_a, contact.body_b, surface_(contact.body_a, contact.body_b),
          !motion.carried.empty() || is_dynamic(contact.body_a) || is_dynamic(contact.body_b)};
}

void NearContacts::foretell(Span<const Contact> contacts, const Motion& motion, Bodies& bodies,
                            ProspectLanes& lanes, Prospect* prospects) const {
  std::array<bool, lane_count> may_have_parts;
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    if (contacts[k].body_a != bodies.a || contacts[k].body_b != bodies.b)
      bodies = bodies_of(contacts[k], motion);
    lanes.thickness[k] = bodies.surface.thickness;
    may_have_parts[k] = bodies.may_have_parts;
  }
  const ProspectMotion<btScalar> of = {motion.start.data(),        motion.end.data(),
                                       motion.inverse_mass.data(), motion.reach.data(),
                                       motion.soft_count(),        recovery_};
  kernels_->find(of, contacts.data(), static_cast<int>(contacts.size()), lanes);
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    prospects[k] = {lanes.move_squared[k], lanes.need[k], lanes.response[k],
                    lanes.gives_way[k] != 0, lanes.may_open[k] != 0};
    if (!may_have_parts[k]) continue;
    ContactRow row;
    make_row(contacts[k], lanes.thickness[k], 0, recovery_, motion, row);
    prospects[k].response = row.response;
    prospects[k].gives_way = row.gives_way;
  }
}

void NearContacts::look_at(Span<const Contact> found, std::size_t first, std::size_t last,
                           const IsAnswered& is_answered, const Motion& motion) {
  Bodies bodies;
  ProspectLanes lanes = {};
  auto before = std::lower_bound(last_.begin(), last_.end(), key_of(found[first]));
  for (std::size_t i = first; i < last; ++i) {
    const std::size_t lane = (i - first) % lane_count;
    if (lane == 0) {
      const Span<const Contact> some(&found[i], std::min(lane_count, last - i));
      foretell(some, motion, bodies, lanes, &prospects_[i]);
    }
    const Contact& contact = found[i];
    Bond& bond = bonds_[i];
    bond.binding.kind = Binding::none;
    if (!is_answered(contact)) continue;
    bond.gap = std::sqrt(lanes.gap_squared[lane]);
    if (says_nothing(contact, lanes.thickness[lane], bond.gap, lanes.gap_kept[lane], motion))
      continue;
    bind(contact, bond.binding);
    // What was chosen in the last step goes on to be, where no other is nearer.
    const Key key = key_of(contact);
    while (before != last_.end() && *before < key) ++before;
    if (before != last_.end() && !(key < *before)) bond.gap *= as_near;
  }
}

NearProspects NearContacts::choose(Span<const Contact> found, const IsAnswered& is_answered,
                                   const Motion& motion, const ParallelFor& parallel_for) {
  last_.swap(chosen_);
  bonds_.resize(found.size());
  prospects_.resize(found.size());
  parallel_for(found.size(), contacts_grain, [&](std::size_t first, std::size_t last) {
    look_at(found, first, last, is_answered, motion);
  });
  distinct_.keep(bonds_);
  chosen_.resize(found.size());
  std::size_t count = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const bool is_chosen = bonds_[i].binding.kind != Binding::none;
    prospects_[i].gives_way = prospects_[i].gives_way && is_chosen;
    chosen_[count] = key_of(found[i]);
    count += is_chosen;
  }
  chosen_.resize(count);
  return {found, prospects_};
}

NearProspects NearContacts::all(Span<const Contact> found, const Motion& motion) {
  Bodies bodies;
  ProspectLanes lanes = {};
  prospects_.resize(found.size());
  for (std::size_t i = 0; i < found.size(); i += lane_count) {
    const Span<const Contact> some(&found[i], std::min(lane_count, found.size() - i));
    foretell(some, motion, bodies, lanes, &prospects_[i]);
  }
  return {found, prospects_};
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
