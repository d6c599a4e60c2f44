// Edges that stick in triangles at one moment.
#pragma once

#include <cstdint>
#include <vector>

#include "scenes/surface.h"

namespace lazyccd::scenes {

// Pairs of an edge and a face without a common vertex whose bodies collide (by filters, and with
// themselves where they do) and where the edge passes through the inside of the face. Exact.
std::int64_t count_piercings(const Surface& surface, const std::vector<btScalar>& positions);

}  // namespace lazyccd::scenes
