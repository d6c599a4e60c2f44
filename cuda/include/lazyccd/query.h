// One elementary test by itself, decided exactly.
#pragma once

#include <array>

#include "lazyccd/contact.h"

namespace lazyccd {

struct QueryResult {
  bool hit = false;
  double toi = 0;  // as in Contact; meaningful where hit
};

// How a query was decided, cheapest first.
enum class Stage { single_precision, double_precision, exact };

// Four points at the start of the step, then the same four at its end.
// vertex_face: vertex, then the face's three; edge_edge: edge a's two, then edge b's two.
using QueryPoints = std::array<std::array<double, 3>, 8>;

// Does the vertex touch the face, or edge a edge b, while the points move linearly from start to end?
// Exact for any finite input: no tolerance, no false answer. `stage`, where given, receives how it was
// decided. Throws Error (non_finite_position) on NaN or infinity.
QueryResult decide(ContactKind kind, const QueryPoints& points, Stage* stage = nullptr);

// Do they come as near as `separation` >= 0 (0: as above), in the unit of the points? Never a miss and
// never late; what double precision cannot tell from the separation counts as it. Throws Error
// (invalid_argument) on a negative or infinite separation.
QueryResult decide_within(ContactKind kind, const QueryPoints& points, double separation);

}  // namespace lazyccd
