// Single elementary tests, without a scene: two primitives over one step.
#pragma once

#include <array>

#include "lazyccd/contact.h"
#include "lazyccd/export.h"

namespace lazyccd {

/// Result of one elementary test.
struct QueryResult {
  bool hit = false;
  double toi = 0;  ///< time of impact as in Contact, in [0, 1]; 0 unless `hit`
};

/// The arithmetic that decided a query, cheapest first.
enum class Stage { single_precision, double_precision, exact };

/// Four points at the start of the step, then the same four points at its end.
/// vertex_face: vertex, then the face's three; edge_edge: edge a's two, then edge b's two.
using QueryPoints = std::array<std::array<double, 3>, 8>;

/// Decides whether the vertex touches the face, or edge a touches edge b, while the points move
/// linearly from start to end. Exact for any finite input: no tolerance, no wrong answer. Sets
/// `*stage` to the arithmetic used, unless `stage` is null. Throws Error(non_finite_position) on
/// NaN or infinity.
LAZYCCD_API QueryResult decide(ContactKind kind, const QueryPoints& points, Stage* stage = nullptr);

/// Decides whether the distance of the two primitives falls to `separation`, or is below it at the
/// start. `separation` >= 0 is in the unit of the points; 0: as decide(). Computed in double
/// precision: never a miss and never late. A distance that rounding cannot tell from the separation
/// counts as a contact. Throws Error(invalid_argument) if the separation is negative or not finite,
/// and Error(non_finite_position) on NaN or infinity.
LAZYCCD_API QueryResult decide_within(ContactKind kind, const QueryPoints& points,
                                      double separation);

}  // namespace lazyccd
