#include "scenes/meshes/surface.h"

namespace lazyccd::scenes {

Topology Surface::topology() const {
  Topology topology;
  topology.vertex_count = body_of_vertex.size();
  topology.faces = faces;
  topology.edges = edges;
  topology.body_of_vertex = body_of_vertex;
  topology.inverse_mass = inverse_mass;
  topology.bodies = bodies;
  return topology;
}

namespace {

Body filter_of(const btCollisionObject& object) {
  Body filter;
  filter.group = static_cast<std::uint32_t>(object.getBroadphaseHandle()->m_collisionFilterGroup);
  filter.mask = static_cast<std::uint32_t>(object.getBroadphaseHandle()->m_collisionFilterMask);
  filter.self_collision = false;
  return filter;
}

}  // namespace

Surface read_surface(const PhysicsWorld& world) {
  Surface surface;
  const auto add_vertex = [&surface](double inverse_mass) {
    surface.body_of_vertex.push_back(static_cast<std::int32_t>(surface.bodies.size()));
    surface.inverse_mass.push_back(static_cast<float>(inverse_mass));
  };
  for (const auto& body : world.bodies()) {
    const auto first = static_cast<std::int32_t>(surface.body_of_vertex.size());
    const auto vertex_of = [&](const btSoftBody::Node* node) {
      return first + static_cast<std::int32_t>(node - &body->m_nodes[0]);
    };
    for (int i = 0; i < body->m_nodes.size(); ++i) {
      add_vertex(static_cast<double>(body->m_nodes[i].m_im));
    }
    for (int i = 0; i < body->m_faces.size(); ++i) {
      Face face;
      for (int k = 0; k < 3; ++k) face[k] = vertex_of(body->m_faces[i].m_n[k]);
      surface.faces.push_back(face);
    }
    for (int i = 0; body->m_faces.size() == 0 && i < body->m_links.size(); ++i) {
      const btSoftBody::Link& link = body->m_links[i];
      if (!link.m_bbending)
        surface.edges.push_back({vertex_of(link.m_n[0]), vertex_of(link.m_n[1])});
    }
    Body filter = filter_of(*body);
    filter.self_collision = body->useSelfCollision();
    surface.bodies.push_back(filter);
  }
  for (const RigidBody& rigid : world.rigid_bodies()) {
    if (!rigid.is_mesh()) continue;
    const auto first = static_cast<std::int32_t>(surface.body_of_vertex.size());
    for (std::size_t i = 0; i < rigid.surface.vertices.size(); ++i) add_vertex(0);
    for (const Face& face : rigid.surface.faces) {
      surface.faces.push_back({first + face[0], first + face[1], first + face[2]});
    }
    surface.bodies.push_back(filter_of(*rigid.body));
  }
  return surface;
}

std::vector<btScalar> read_positions(const PhysicsWorld& world) {
  std::vector<btScalar> positions;
  const auto add = [&positions](const btVector3& x) {
    for (int k = 0; k < 3; ++k) positions.push_back(x[k]);
  };
  for (const auto& body : world.bodies()) {
    for (int i = 0; i < body->m_nodes.size(); ++i) add(body->m_nodes[i].m_x);
  }
  for (const RigidBody& rigid : world.rigid_bodies()) {
    if (!rigid.is_mesh()) continue;
    const btTransform& pose = rigid.body->getWorldTransform();
    for (const btVector3& vertex : rigid.surface.vertices) add(pose * vertex);
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
