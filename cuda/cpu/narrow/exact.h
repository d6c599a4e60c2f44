// The last stage of the narrow phase: exact decisions with integer arithmetic of any size.
//
// The time of impact is floor(2^32 t) / 2^32, where t in [0, 1] is the first time of contact. This
// is the definition of Contact::toi.
#pragma once

#include "core/narrow/contact_math.h"
#include "lazyccd/query.h"
#include "lazyccd/scene.h"

namespace lazyccd {

/// Decides a query exactly. Always terminates. The points must be finite.
QueryResult decide_exact(ContactKind kind, const QueryPoints& points);

/// The same for points in the layout of the narrow phase.
Decision decide_exactly(ContactKind kind, const QueryCoordinates& q);

/// The same for a candidate of a scene. Fills `contact` and returns true if the two touch.
bool decide_exactly(ContactKind kind, const MeshView& mesh, Candidate pair, const Positions& start,
                    const Positions& end, Contact& contact);

}  // namespace lazyccd
