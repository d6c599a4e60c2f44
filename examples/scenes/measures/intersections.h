// Intersections of edges with triangles at one moment.
#pragma once

#include <array>
#include <vector>

#include "scenes/meshes/surface.h"

namespace lazyccd::scenes {

/// An edge that passes through the inside of a face.
struct Intersection {
  Edge edge;
  Face face;
  std::array<double, 3> point;  // the point of intersection, rounded
};

/// Finds all pairs of an edge and a face in which the edge passes through the inside of the face.
/// The two share no vertex, and their bodies may collide by Bullet's filters (or one body collides
/// with itself). The test is exact; only the point is rounded.
std::vector<Intersection> find_intersections(const Surface& surface,
                                             const std::vector<btScalar>& positions);

}  // namespace lazyccd::scenes
