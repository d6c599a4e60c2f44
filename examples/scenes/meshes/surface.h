// A world as triangles and edges, for written frames and for the counters of pass-throughs and
// intersections. It is read without the adapter's code, so that the counters check the adapter
// independently.
#pragma once

#include <vector>

#include "io/mesh.h"
#include "scenes/worlds/physics_world.h"

namespace lazyccd::scenes {

/// Primitives of a world in one index space, as in lazyccd::Topology.
struct Surface {
  std::vector<Face> faces;
  std::vector<Edge> edges;  // edges that are not a side of a face: ropes
  std::vector<std::int32_t> body_of_vertex;
  std::vector<float> inverse_mass;
  std::vector<Body> bodies;

  Topology topology() const;  // refers to this surface
};

/// Reads the primitives of a world. The vertices are the nodes of all soft bodies in order, then
/// the vertices of the rigid bodies that are meshes, with infinite mass. Bodies have Bullet's
/// filters.
Surface read_surface(const PhysicsWorld& world);
/// Returns three coordinates a vertex, exactly as Bullet holds them.
std::vector<btScalar> read_positions(const PhysicsWorld& world);

io::Mesh to_mesh(const Surface& surface, const std::vector<btScalar>& positions);

}  // namespace lazyccd::scenes
