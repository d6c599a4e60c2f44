// A world as triangles and edges: what frames, crossings and intersections look at. Read apart from the
// adapter, so that the counters can tell on it.
#pragma once

#include <vector>

#include "io/mesh.h"
#include "scenes/worlds/physics_world.h"

namespace lazyccd::scenes {

struct Surface {
  std::vector<Face> faces;
  std::vector<Edge> edges;  // that are a side of no face: ropes
  std::vector<std::int32_t> body_of_vertex;
  std::vector<float> inverse_mass;
  std::vector<Body> bodies;

  Topology topology() const;
};

// Vertices are all nodes of all soft bodies, in order; then those of the rigid bodies that are
// meshes, with infinite mass. Bodies are as in Bullet's filters.
Surface read_surface(const PhysicsWorld& world);
// Three numbers a vertex, exactly Bullet's.
std::vector<btScalar> read_positions(const PhysicsWorld& world);

io::Mesh to_mesh(const Surface& surface, const std::vector<btScalar>& positions);

}  // namespace lazyccd::scenes
