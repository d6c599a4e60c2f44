#include "detection/hidden_contacts.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>

#include "settings.h"
#include "util/profile.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

constexpr std::size_t grain = 1024;  // contacts; more work than it costs to distribute them

bool is_b(std::int32_t side) { return side % 2 != 0; }

bool is_of_vertex(const Contact& contact, bool is_b) {
  return contact.kind == ContactKind::vertex_face && !is_b;
}

// Vertices, faces and edges have lists of their own, in turn.
std::size_t list_of(const Contact& contact, bool is_b) {
  const int kind = contact.kind == ContactKind::edge_edge ? 2 : is_b ? 1 : 0;
  return 3 * static_cast<std::size_t>(is_b ? contact.primitive_b : contact.primitive_a) + kind;
}

// So many lists include those of all primitives of the contacts.
std::size_t count_lists(Span<const Contact> contacts, const Threads& threads) {
  std::atomic<std::int32_t> largest{0};  // relaxed: read after the end of the parallel loop
  const auto range = [&](std::size_t first, std::size_t last) {
    std::int32_t of_range = 0;
    for (std::size_t i = first; i < last; ++i)
      of_range = std::max({of_range, contacts[i].primitive_a, contacts[i].primitive_b});
    std::int32_t of_others = largest.load(std::memory_order_relaxed);
    while (of_others < of_range &&
           !largest.compare_exchange_weak(of_others, of_range, std::memory_order_relaxed)) {
    }
  };
  threads.parallel_for(contacts.size(), grain, std::cref(range));
  return 3 * (static_cast<std::size_t>(largest.load(std::memory_order_relaxed)) + 1);
}

bool is_of_soft_body(const Contact& contact, bool is_b, const Motion& motion) {
  return motion.rigid_of_body()[is_b ? contact.body_b : contact.body_a] < 0;
}

}  // namespace

template <class Each>
void HiddenContacts::for_each_contact(const Input& input, const Each& each) {
  const auto range = [&each](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) each(i);
  };
  input.threads.parallel_for(input.near.contacts.size(), grain, std::cref(range));
}

void HiddenContacts::make_lists(const Input& input) {
  const Span<const Contact> contacts = input.near.contacts;
  lists_.reserve(count_lists(contacts, input.threads), 2 * contacts.size());
  if (!are_empty_) lists_.empty_first(lists_.list_count());
  are_empty_ = false;
  is_listed_.resize(contacts.size());
  for_each_contact(input, [&](std::size_t i) {
    is_listed_[i] =
        input.entries[i].key.kind != ConstraintKey::none && input.near.estimates[i].can_act;
    if (!is_listed_[i]) return;
    for (const bool b : {false, true})
      if (is_of_soft_body(contacts[i], b, input.motion))
        lists_.add(list_of(contacts[i], b), static_cast<Side>(2 * i + b));
  });
}

bool HiddenContacts::find_points(const Input& input) {
  const Span<const Contact> contacts = input.near.contacts;
  points_.resize(contacts.size());
  std::atomic<bool> any{false};  // relaxed: read after the end of the parallel loop
  for_each_contact(input, [&](std::size_t i) {
    const auto has_others = [&](bool b) {
      return is_of_soft_body(contacts[i], b, input.motion) &&
             lists_.has_others(list_of(contacts[i], b), static_cast<Side>(2 * i + b));
    };
    is_listed_[i] = is_listed_[i] && (has_others(false) || has_others(true));
    if (!is_listed_[i]) return;
    points_[i] = points_of(contacts[i], input.motion);
    // Stored once: threads that all write the same place wait for each other.
    if (!any.load(std::memory_order_relaxed)) any.store(true, std::memory_order_relaxed);
  });
  return any.load(std::memory_order_relaxed);
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

bool HiddenContacts::hides(const Input& input, Side nearer, Side farther) const {
  const Points &near = points_[nearer / 2], &far = points_[farther / 2];
  const auto &own_near = is_b(nearer) ? near.b : near.a,
             &other_near = is_b(nearer) ? near.a : near.b;
  const auto &own_far = is_b(farther) ? far.b : far.a, &other_far = is_b(farther) ? far.a : far.b;
  const Contact &contact = input.contact_of(nearer), &hidden = input.contact_of(farther);
  const std::array<float, 3>& n = contact.normal;
  const Vector3d to_nearer = (is_b(nearer) ? 1 : -1) * Vector3d(n[0], n[1], n[2]);
  for (const int time : {0, 1}) {
    const Vector3d way = other_far[time] - other_near[time];
    if (to_nearer.dot(way) <
        (own_far[time] - own_near[time]).norm() + settings::detection::hidden_slope * way.norm())
      return false;
  }
  return stop_each_other_(is_b(nearer) ? contact.body_a : contact.body_b,
                          is_b(farther) ? hidden.body_a : hidden.body_b);
}

void HiddenContacts::find_hidden(const Input& input, Side first, std::vector<SideByGap>& list) {
  list.clear();
  for (Side side = first; side != ParallelLists::none; side = lists_.next(side)) {
    const bool is_vertex_face = input.contact_of(side).kind == ContactKind::vertex_face;
    const Side of_vertex = side - side % 2;
    if (!is_vertex_face || !hidden_[of_vertex])
      list.emplace_back(input.entries[side / 2].gap, side);
  }
  std::sort(list.begin(), list.end());
  std::size_t unhidden = 0;  // so many of the list; they come first
  for (std::size_t k = 0; k < list.size(); ++k) {
    const SideByGap farther = list[k];
    const std::size_t last = std::min(unhidden, settings::detection::max_hiding);
    std::size_t i = 0;
    while (i < last && !hides(input, list[i].second, farther.second)) ++i;
    hidden_[farther.second] = i < last;
    if (i == last) list[unhidden++] = farther;
  }
}

void HiddenContacts::find_hidden(const Input& input, bool of_vertices) {
  const Span<const Contact> contacts = input.near.contacts;
  const std::size_t parts = (contacts.size() + grain - 1) / grain;
  if (scratch_.size() < parts) scratch_.resize(parts);
  const auto look_through = [&](std::size_t part) {
    for (std::size_t i = part * grain; i < std::min((part + 1) * grain, contacts.size()); ++i) {
      if (!is_listed_[i]) continue;
      for (const bool b : {false, true}) {
        const auto side = static_cast<Side>(2 * i + b);
        if (is_of_vertex(contacts[i], b) == of_vertices &&
            lists_.first(list_of(contacts[i], b)) == side &&
            lists_.next(side) != ParallelLists::none)
          find_hidden(input, side, scratch_[part]);
      }
    }
  };
  const auto range = [&look_through](std::size_t first, std::size_t last) {
    for (std::size_t part = first; part < last; ++part) look_through(part);
  };
  input.threads.parallel_for(parts, 1, std::cref(range));
}

void HiddenContacts::drop(const NearContacts& near, const Motion& motion, const Threads& threads,
                          std::vector<ReductionEntry>& entries) {
  LAZYCCD_BT_PROFILE("hidden");
  const Input input = {near, motion, threads, entries};
  make_lists(input);
  const bool any = find_points(input);
  if (any) {
    hidden_.assign(2 * near.contacts.size(), 0);
    // Vertices first: most of what faces would look through is hidden then.
    find_hidden(input, true);
    find_hidden(input, false);
  }
  for_each_contact(input, [&](std::size_t i) {
    if (any && (hidden_[2 * i] || hidden_[2 * i + 1])) entries[i].key.kind = ConstraintKey::none;
    for (const bool b : {false, true}) lists_.empty(list_of(near.contacts[i], b));
  });
  are_empty_ = true;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
