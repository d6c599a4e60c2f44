// A candidate of a scene decided by exact arithmetic alone.
#pragma once

#include "core/contact_math.h"
#include "lazyccd/scene.h"

namespace lazyccd {

// The exact stage for points that are at hand.
Decision decide_exactly(ContactKind kind, const QueryCoordinates& q);

// Fills the contact; false: the two never touch.
bool decide_exactly(ContactKind kind, const MeshView& mesh, Candidate pair, const Positions& start,
                    const Positions& end, Contact& contact);

}  // namespace lazyccd
