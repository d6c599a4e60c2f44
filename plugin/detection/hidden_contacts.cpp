#include "detection/hidden_contacts.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "settings.h"
#include "util/profile.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

constexpr std::int32_t none = -1;

bool is_b(std::int32_t side) { return side % 2 != 0; }
const Contact& contact_of(std::int32_t side, Span<const Contact> contacts) {
  return contacts[static_cast<std::size_t>(side / 2)];
}
std::int32_t primitive_of(const Contact& contact, bool is_b) {
  return is_b ? contact.primitive_b : contact.primitive_a;
}

}  // namespace

void HiddenContacts::make_lists(const NearContacts& near, const Motion& motion,
                                const std::vector<ReductionEntry>& entries) {
  if (!are_cleared_) {
    for (std::vector<Side>* first : {&first_of_vertex_, &first_of_face_, &first_of_edge_})
      first->clear();
  }
  are_cleared_ = false;
  next_.resize(2 * near.contacts.size());
  for (std::vector<Side>& sides : multiple_) sides.clear();
  for (std::size_t i = 0; i < near.contacts.size(); ++i) {
    if (entries[i].key.kind == ConstraintKey::none || !near.estimates[i].can_act) continue;
    const Contact& contact = near.contacts[i];
    for (const bool b : {false, true}) {
      if (motion.rigid_of_body[b ? contact.body_b : contact.body_a] >= 0) continue;
      std::vector<Side>& first = first_of(contact.kind, b);
      const auto primitive = static_cast<std::size_t>(primitive_of(contact, b));
      if (primitive >= first.size()) first.resize(2 * primitive + 1, none);
      const auto side = static_cast<Side>(2 * i + b);
      next_[side] = std::exchange(first[primitive], side);
      if (next_[side] != none && next_[next_[side]] == none)
        multiple_[contact.kind == ContactKind::vertex_face && !b ? 0 : 1].push_back(side);
    }
  }
  for (std::vector<Side>& sides : multiple_) {
    for (Side& side : sides) {
      const Contact& contact = contact_of(side, near.contacts);
      side = first_of(contact.kind, is_b(side))[primitive_of(contact, is_b(side))];
    }
  }
  clear_lists(near.contacts);
}

// The sides in multiple_ and next_ are all that is needed of the lists.
void HiddenContacts::clear_lists(Span<const Contact> contacts) {
  for (const Contact& contact : contacts) {
    for (const bool b : {false, true}) {
      std::vector<Side>& first = first_of(contact.kind, b);
      const auto primitive = static_cast<std::size_t>(primitive_of(contact, b));
      if (primitive < first.size()) first[primitive] = none;
    }
  }
  are_cleared_ = true;
}

void HiddenContacts::find_points(Span<const Contact> contacts, const Motion& motion,
                                 const Threads& threads) {
  is_listed_.assign(contacts.size(), 0);
  for (const std::vector<Side>& sides : multiple_)
    for (const Side first : sides)
      for (Side side = first; side != none; side = next_[side]) is_listed_[side / 2] = 1;
  points_.resize(contacts.size());
  constexpr std::size_t grain = 512;  // contacts; more work than it costs to distribute them
  threads.parallel_for(contacts.size(), grain, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i)
      if (is_listed_[i]) points_[i] = points_of(contacts[i], motion);
  });
}

HiddenContacts::Points HiddenContacts::points_of(const Contact& contact, const Motion& motion) {
  const std::array<double, 4> weights = contact.weights();
  const int first_of_b = first_vertex_of_b(contact.kind);
  Points points;
  for (std::array<Vector3d, 2>* of : {&points.a, &points.b}) of->fill(Vector3d::Zero());
  for (int k = 0; k < 4; ++k) {
    std::array<Vector3d, 2>& of = k < first_of_b ? points.a : points.b;
    of[0] += std::abs(weights[k]) * motion.start_of(contact.vertices[k]);
    of[1] += std::abs(weights[k]) * motion.end_of(contact.vertices[k]);
  }
  return points;
}

bool HiddenContacts::hides(Side nearer, Side farther, Span<const Contact> contacts) const {
  const Points &near = points_[nearer / 2], &far = points_[farther / 2];
  const auto &own_near = is_b(nearer) ? near.b : near.a,
             &other_near = is_b(nearer) ? near.a : near.b;
  const auto &own_far = is_b(farther) ? far.b : far.a, &other_far = is_b(farther) ? far.a : far.b;
  const Contact& contact = contact_of(nearer, contacts);
  const std::array<float, 3>& n = contact.normal;
  const Vector3d to_nearer = (is_b(nearer) ? 1 : -1) * Vector3d(n[0], n[1], n[2]);
  for (const int time : {0, 1}) {
    const Vector3d way = other_far[time] - other_near[time];
    if (to_nearer.dot(way) <
        (own_far[time] - own_near[time]).norm() + settings::detection::hidden_slope * way.norm())
      return false;
  }
  const Contact& hidden = contact_of(farther, contacts);
  return stop_each_other_(is_b(nearer) ? contact.body_a : contact.body_b,
                          is_b(farther) ? hidden.body_a : hidden.body_b);
}

void HiddenContacts::find_hidden(Side first, Span<const Contact> contacts,
                                 const std::vector<ReductionEntry>& entries,
                                 std::vector<SideByGap>& list) {
  list.clear();
  for (Side side = first; side != none; side = next_[side]) {
    const bool is_vertex_face = contact_of(side, contacts).kind == ContactKind::vertex_face;
    const Side of_vertex = side - side % 2;
    if (!is_vertex_face || !hidden_[of_vertex]) list.emplace_back(entries[side / 2].gap, side);
  }
  std::sort(list.begin(), list.end());
  std::size_t unhidden = 0;  // so many of the list; they come first
  for (std::size_t k = 0; k < list.size(); ++k) {
    const SideByGap farther = list[k];
    const std::size_t last = std::min(unhidden, settings::detection::max_hiding);
    std::size_t i = 0;
    while (i < last && !hides(list[i].second, farther.second, contacts)) ++i;
    hidden_[farther.second] = i < last;
    if (i == last) list[unhidden++] = farther;
  }
}

void HiddenContacts::drop(const NearContacts& near, const Motion& motion, const Threads& threads,
                          std::vector<ReductionEntry>& entries) {
  LAZYCCD_BT_PROFILE("hidden");
  make_lists(near, motion, entries);
  if (multiple_[0].empty() && multiple_[1].empty()) return;
  find_points(near.contacts, motion, threads);
  hidden_.assign(next_.size(), 0);
  // Vertices first: most of what faces would look through is hidden then.
  for (const std::vector<Side>& sides : multiple_) {
    constexpr std::size_t grain = 64;  // lists; more work than it costs to distribute them
    const std::size_t parts = (sides.size() + grain - 1) / grain;
    if (scratch_.size() < parts) scratch_.resize(parts);
    threads.parallel_for(parts, 1, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first * grain; i < std::min(last * grain, sides.size()); ++i)
        find_hidden(sides[i], near.contacts, entries, scratch_[i / grain]);
    });
  }
  for (std::size_t side = 0; side < hidden_.size(); ++side)
    if (hidden_[side]) entries[side / 2].key.kind = ConstraintKey::none;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
