// Edges that stick in triangles at one moment.
#pragma once

#include <array>
#include <vector>

#include "scenes/meshes/surface.h"

namespace lazyccd::scenes {

struct Intersection {
  Edge edge;
  Face face;
  std::array<double, 3> point;  // where the edge passes through, rounded
};

// Pairs of an edge and a face without a common vertex whose bodies collide (by filters, and with
// themselves where they do) and where the edge passes through the inside of the face. Which pairs
// is decided exactly.
std::vector<Intersection> find_intersections(const Surface& surface,
                                     const std::vector<btScalar>& positions);

}  // namespace lazyccd::scenes
