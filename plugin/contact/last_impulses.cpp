#include "contact/last_impulses.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "contact/contact_checks.h"
#include "lazyccd/debug/assert.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

auto vertices_of(const Contact& contact) { return std::tie(contact.kind, contact.vertices); }

bool is_before_by_vertices(const LastImpulses::Pair& pair, const Contact& contact) {
  return vertices_of(pair.contact) < vertices_of(contact);
}

bool has_old_indices(const Renumbering& numbers, const Contact& contact) {
  const auto is_below = [](std::int32_t i, const std::vector<std::int32_t>& of) {
    return i >= 0 && i < static_cast<std::int32_t>(of.size());
  };
  return is_below(contact.body_a, numbers.bodies) && is_below(contact.body_b, numbers.bodies) &&
         std::all_of(contact.vertices.begin(), contact.vertices.end(),
                     [&](std::int32_t v) { return is_below(v, numbers.vertices); });
}

// Gives a contact its new indices, all but those of faces and edges. Returns false if something of
// it is gone.
bool renumber(const Renumbering& numbers, Contact& contact) {
  LAZYCCD_ASSERT(has_old_indices(numbers, contact), "old indices of a contact are in range");
  contact.body_a = numbers.bodies[contact.body_a];
  contact.body_b = numbers.bodies[contact.body_b];
  for (std::int32_t& v : contact.vertices) v = numbers.vertices[v];
  return contact.body_a >= 0 && contact.body_b >= 0 &&
         std::all_of(contact.vertices.begin(), contact.vertices.end(),
                     [](std::int32_t v) { return v >= 0; });
}

// The detector reports an edge of the body with the smaller index first.
void order_edges(LastImpulses::Pair& pair) {
  Contact& contact = pair.contact;
  if (contact.kind != ContactKind::edge_edge || contact.body_a <= contact.body_b) return;
  std::swap(contact.body_a, contact.body_b);
  std::swap_ranges(contact.vertices.begin(), contact.vertices.begin() + 2,
                   contact.vertices.begin() + 2);
  pair.impulse = -pair.impulse;
}

}  // namespace

void LastImpulses::take(const std::vector<const ContactRow*>& rows) {
  LAZYCCD_ASSERT(are_in_order(rows), "rows whose impulses are kept are in order");
  pairs_.clear();
  needs_match_ = false;
  for (const ContactRow* const row : rows) {
    if (row->normal_impulse == 0) continue;
    if (pairs_.empty() || pairs_.back().contact < row->contact)
      pairs_.push_back({row->contact, Vector3d::Zero(), 0});
    pairs_.back().impulse += row->impulse();
    pairs_.back().gap = std::max(pairs_.back().gap, row->loaded_gap);
  }
}

void LastImpulses::renumber(const Renumbering& numbers) {
  needs_match_ = true;
  pairs_.erase(std::remove_if(pairs_.begin(), pairs_.end(),
                              [&](Pair& pair) { return !bullet::renumber(numbers, pair.contact); }),
               pairs_.end());
  for (Pair& pair : pairs_) order_edges(pair);
}

void LastImpulses::match(Span<const Contact> near) {
  LAZYCCD_ASSERT(are_sorted(near), "contacts that impulses are matched with are sorted");
  if (!std::exchange(needs_match_, false)) return;
  std::sort(pairs_.begin(), pairs_.end(),
            [](const Pair& a, const Pair& b) { return is_before_by_vertices(a, b.contact); });
  std::vector<Pair> matched;
  for (const Contact& contact : near) {
    const auto pair =
        std::lower_bound(pairs_.begin(), pairs_.end(), contact, is_before_by_vertices);
    if (pair != pairs_.end() && vertices_of(pair->contact) == vertices_of(contact))
      matched.push_back({contact, pair->impulse, pair->gap});
  }
  pairs_ = std::move(matched);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
