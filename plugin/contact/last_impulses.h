// Impulses of the last step, from which the solver starts (warm start). They outlast a change of
// the scene: what stays in it keeps its impulses, under its new indices.
#pragma once

#include <cstddef>
#include <vector>

#include "contact/contact_row.h"
#include "contact/renumbering.h"
#include "lazyccd/contact.h"
#include "lazyccd/span.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class LastImpulses {
 public:
  /// Sum of the impulses of a pair.
  struct Pair {
    Contact contact;
    Vector3d impulse;  ///< unit as in ContactRow
    double gap;        ///< that it had when the load came, metres
  };

  /// Replaces all by the impulses of these rows, which are sorted by contact.
  void take(const std::vector<const ContactRow*>& rows);
  void clear() { pairs_.clear(); }
  /// Gives bodies and vertices their new indices. Drops pairs of which something is gone.
  void renumber(const Renumbering& numbers);
  /// Whether match() is to be called before pairs().
  bool needs_match() const { return needs_match_; }
  /// After renumber(): gives each pair the near contact that has its vertices, as indices of faces
  /// and edges have changed too. `near` is sorted. Drops pairs without one.
  void match(Span<const Contact> near);

  /// Sorted by contact.
  const std::vector<Pair>& pairs() const { return pairs_; }

 private:
  std::vector<Pair> pairs_;
  bool needs_match_ = false;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
