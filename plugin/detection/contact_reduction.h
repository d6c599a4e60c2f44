// Contact reduction: finds contacts that constrain the same points. If a vertex lies above a
// vertex, every face and edge of the first is near every face and edge of the second. All these
// pairs state the same constraint.
//
// The detector has already merged pairs at shared edges and vertices. This merges pairs with nearly
// equal weights and normals.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "detection/parallel_lists.h"
#include "lazyccd/bullet/precision.h"
#include "lazyccd/contact.h"
#include "lazyccd/threads.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Identifies what a contact constrains. Two keys are equal if the same vertices have the same
/// weights, rounded to 1/16, and the normals, rounded to 1/4, are equal. Which side comes first
/// makes no difference.
struct ConstraintKey {
  /// unique: all four vertices have weight, so no other pair of primitives constrains the same
  /// points. shared: other pairs may have the same key. none: the contact was dropped.
  enum Kind : std::uint8_t { none, unique, shared } kind = none;
  std::uint32_t hash;  ///< hash of `points`; set only if kind is shared
  /// Three vertices, their rounded weights and the rounded normal. Set only if kind is shared.
  std::array<std::uint64_t, 3> points;
};

/// Writes the key of a contact into `key`. It is not returned by value, because copying a key that
/// was just made takes longer than making it.
void make_constraint_key(const Contact& contact, ConstraintKey& key);

/// Input of reduce() for one contact.
struct ReductionEntry {
  ConstraintKey key;  ///< kind none: the contact is dropped
  double gap = 0;     ///< metres, between its points at the start of the step
};

/// Keeps its buffers between steps.
class ContactReduction {
 public:
  /// Keeps one of the contacts with equal keys: the nearest one, or the first of equally near ones.
  /// Sets the kind of the others to ConstraintKey::none.
  void reduce(std::vector<ReductionEntry>& entries, const Threads& threads);

 private:
  /// Does the same for the contacts of a list.
  void reduce(std::size_t list, std::vector<ReductionEntry>& entries);

  ParallelLists by_hash_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
