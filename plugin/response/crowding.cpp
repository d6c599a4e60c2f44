#include "response/crowding.h"

#include <algorithm>

#include "settings.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

bool are_crowded(Span<const Contact* const> contacts) {
  if (contacts.size() < settings::rounds::min_crowded_contacts) return false;
  ScratchVector<std::int32_t> vertices;
  vertices.reserve(4 * contacts.size());
  for (const Contact* const contact : contacts)
    vertices.insert(vertices.end(), contact->vertices.begin(), contact->vertices.end());
  std::sort(vertices.begin(), vertices.end());
  const auto last = std::unique(vertices.begin(), vertices.end());
  return contacts.size() > static_cast<std::size_t>(last - vertices.begin());
}

}  // namespace

bool Crowding::select_others(const std::vector<Contact>& contacts, RowIslands& islands) const {
  islands.select_none();
  bool any = false;
  for (const Contact& contact : contacts) {
    if (is_given_up(contact)) continue;
    islands.select_body(contact.body_a);
    islands.select_body(contact.body_b);
    any = true;
  }
  return any;
}

void Crowding::add_round(const std::vector<Contact>& contacts, const RowIslands& islands) {
  ScratchVector<std::int32_t>& now = counts_.emplace_back(given_up_.size(), 0);
  for (const Contact& contact : contacts) {
    ++now[contact.body_a];
    ++now[contact.body_b];
  }
  if (counts_.size() <= settings::rounds::rounds_to_halve ||
      contacts.size() < settings::rounds::min_crowded_contacts)
    return;
  const ScratchVector<std::int32_t>& before =
      counts_[counts_.size() - 1 - settings::rounds::rounds_to_halve];
  struct Island {
    std::int64_t now = 0, before = 0;
    ScratchVector<const Contact*> contacts;
    bool is_stuck = false;
  };
  ScratchVector<Island> found(islands.count());
  const auto bodies = static_cast<std::int32_t>(given_up_.size());
  for (std::int32_t body = 0; body < bodies; ++body) {
    if (islands.of_body(body) < 0) continue;
    Island& island = found[islands.of_body(body)];
    island.now += now[body];
    island.before += before[body];
  }
  for (const Contact& contact : contacts) {
    const std::int32_t of_a = islands.of_body(contact.body_a),
                       island = of_a >= 0 ? of_a : islands.of_body(contact.body_b);
    if (island >= 0) found[island].contacts.push_back(&contact);
  }
  for (Island& island : found)
    island.is_stuck = 2 * island.now > island.before && are_crowded(island.contacts);
  for (std::int32_t body = 0; body < bodies; ++body)
    if (islands.of_body(body) >= 0 && found[islands.of_body(body)].is_stuck) given_up_[body] = 1;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
