// Crowded contacts: more contacts than vertices in contact, so that single vertices have many.
// Impulses hardly resolve them. Islands in which they stay are left to impact zones, while the
// others go on with impulses.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "lazyccd/contact.h"
#include "solver/row_islands.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Follows the contacts of a step from one round of impulses to the next.
class Crowding {
 public:
  explicit Crowding(std::size_t bodies) : given_up_(bodies, 0) {}

  /// Counts the contacts before a round, and gives up the islands that impulses do not help.
  /// `islands`: of the rows with these contacts.
  void add_round(const std::vector<Contact>& contacts, const RowIslands& islands);
  /// Selects the islands of these contacts that were not given up, and no others. Returns whether
  /// there are any.
  bool select_others(const std::vector<Contact>& contacts, RowIslands& islands) const;
  /// Whether the island of the contact was given up.
  bool is_given_up(const Contact& contact) const {
    return given_up_[contact.body_a] || given_up_[contact.body_b];
  }

 private:
  ScratchVector<ScratchVector<std::int32_t>> counts_;  // by round and body: contacts with the body
  ScratchVector<char> given_up_;                       // by body that rows move
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
