#include "scenes/surface.h"

namespace lazyccd::scenes {

Topology Surface::topology() const {
  Topology topology;
  topology.vertex_count = body_of_vertex.size();
  topology.faces = faces;
  topology.body_of_vertex = body_of_vertex;
  topology.inverse_mass = inverse_mass;
  topology.bodies = bodies;
  return topology;
}

Surface read_surface(const PhysicsWorld& world) {
  Surface surface;
  for (const auto& body : world.bodies()) {
    const auto first = static_cast<std::int32_t>(surface.body_of_vertex.size());
    const auto index = static_cast<std::int32_t>(surface.bodies.size());
    for (int i = 0; i < body->m_nodes.size(); ++i) {
      surface.body_of_vertex.push_back(index);
      surface.inverse_mass.push_back(static_cast<float>(body->m_nodes[i].m_im));
    }
    for (int i = 0; i < body->m_faces.size(); ++i) {
      Face face;
      for (int k = 0; k < 3; ++k) {
        face[k] = first + static_cast<std::int32_t>(body->m_faces[i].m_n[k] - &body->m_nodes[0]);
      }
      surface.faces.push_back(face);
    }
    Body filter;
    filter.group = static_cast<std::uint32_t>(body->getBroadphaseHandle()->m_collisionFilterGroup);
    filter.mask = static_cast<std::uint32_t>(body->getBroadphaseHandle()->m_collisionFilterMask);
    filter.self_collision = body->useSelfCollision();
    surface.bodies.push_back(filter);
  }
  return surface;
}

std::vector<btScalar> read_positions(const PhysicsWorld& world) {
  std::vector<btScalar> positions;
  for (const auto& body : world.bodies()) {
    for (int i = 0; i < body->m_nodes.size(); ++i) {
      for (int k = 0; k < 3; ++k) positions.push_back(body->m_nodes[i].m_x[k]);
    }
  }
  return positions;
}

io::Mesh to_mesh(const Surface& surface, const std::vector<btScalar>& positions) {
  io::Mesh mesh;
  mesh.faces = surface.faces;
  for (std::size_t i = 0; i < positions.size(); i += 3) {
    mesh.vertices.push_back({static_cast<double>(positions[i]),
                             static_cast<double>(positions[i + 1]),
                             static_cast<double>(positions[i + 2])});
  }
  return mesh;
}

}  // namespace lazyccd::scenes
