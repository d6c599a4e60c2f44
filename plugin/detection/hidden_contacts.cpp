#include "detection/hidden_contacts.h"

#include <algorithm>
#include <cmath>
#include <tuple>

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
  next_.resize(2 * near.contacts.size());
  for (std::vector<Side>& shared : shared_) shared.clear();
  for (std::size_t i = 0; i < near.contacts.size(); ++i) {
    if (entries[i].key.kind == ConstraintKey::none || !near.estimates[i].can_act) continue;
    const Contact& contact = near.contacts[i];
    for (const bool b : {false, true}) {
      if (motion.rigid_of_body[b ? contact.body_b : contact.body_a] >= 0) continue;
      std::vector<Side>& first = lists_of(contact.kind, b).first;
      const auto primitive = static_cast<std::size_t>(primitive_of(contact, b));
      if (primitive >= first.size()) first.resize(2 * primitive + 1, none);
      const auto side = static_cast<Side>(2 * i + b);
      next_[side] = std::exchange(first[primitive], side);
      if (next_[side] != none && next_[next_[side]] == none)
        shared_[contact.kind == ContactKind::vertex_face && !b ? 0 : 1].push_back(side);
    }
  }
  for (std::vector<Side>& shared : shared_) {
    for (Side& side : shared) {
      const Contact& contact = contact_of(side, near.contacts);
      side = lists_of(contact.kind, is_b(side)).first[primitive_of(contact, is_b(side))];
    }
  }
  // The next step begins with empty lists.
  for (std::size_t i = 0; i < near.contacts.size(); ++i) {
    const Contact& contact = near.contacts[i];
    for (const bool b : {false, true}) {
      std::vector<Side>& first = lists_of(contact.kind, b).first;
      const auto primitive = static_cast<std::size_t>(primitive_of(contact, b));
      if (primitive < first.size()) first[primitive] = none;
    }
  }
}

void HiddenContacts::find_points(Span<const Contact> contacts, const Motion& motion,
                                 const Threads& threads) {
  is_listed_.assign(contacts.size(), 0);
  for (const std::vector<Side>& shared : shared_)
    for (const Side first : shared)
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
                                 std::vector<Near>& list) {
  list.clear();
  for (Side side = first; side != none; side = next_[side]) {
    const bool is_of_vertex = contact_of(side, contacts).kind == ContactKind::vertex_face;
    if (!is_of_vertex || !hidden_[2 * (side / 2)]) list.emplace_back(entries[side / 2].gap, side);
  }
  std::sort(list.begin(), list.end());
  std::size_t seen = 0;  // so many of the list are not hidden; they come first
  for (std::size_t k = 0; k < list.size(); ++k) {
    const Near near = list[k];
    const Side side = near.second;
    const std::size_t last = std::min(seen, settings::detection::max_hiding);
    std::size_t i = 0;
    while (i < last && !hides(list[i].second, side, contacts)) ++i;
    hidden_[side] = i < last;
    if (i == last) list[seen++] = near;
  }
}

void HiddenContacts::drop(const NearContacts& near, const Motion& motion, const Threads& threads,
                          std::vector<ReductionEntry>& entries) {
  LAZYCCD_BT_PROFILE("hidden");
  make_lists(near, motion, entries);
  if (shared_[0].empty() && shared_[1].empty()) return;
  find_points(near.contacts, motion, threads);
  hidden_.assign(next_.size(), 0);
  // Most of what faces see is hidden from its vertices already.
  for (const std::vector<Side>& shared : shared_) {
    constexpr std::size_t grain = 64;  // lists; more work than it costs to distribute them
    threads.parallel_for(shared.size(), grain, [&](std::size_t first, std::size_t last) {
      std::vector<Near> list;
      for (std::size_t i = first; i < last; ++i)
        find_hidden(shared[i], near.contacts, entries, list);
    });
  }
  for (std::size_t side = 0; side < hidden_.size(); ++side)
    if (hidden_[side]) entries[side / 2].key.kind = ConstraintKey::none;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
