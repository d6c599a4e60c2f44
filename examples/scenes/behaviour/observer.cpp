#include "scenes/behaviour/observer.h"

#include <algorithm>
#include <cmath>

#include "scenes/measures/intersections.h"

namespace lazyccd::scenes::behaviour {
namespace {

Body filter_of(const btCollisionObject& object) {
  Body filter;
  filter.group = static_cast<std::uint32_t>(object.getBroadphaseHandle()->m_collisionFilterGroup);
  filter.mask = static_cast<std::uint32_t>(object.getBroadphaseHandle()->m_collisionFilterMask);
  filter.self_collision = false;
  return filter;
}

void add_soft_body(Surface& surface, const btSoftBody& body) {
  const auto first = static_cast<std::int32_t>(surface.body_of_vertex.size());
  const auto vertex_of = [&](const btSoftBody::Node* node) {
    return first + static_cast<std::int32_t>(node - &body.m_nodes[0]);
  };
  for (int i = 0; i < body.m_nodes.size(); ++i) {
    surface.body_of_vertex.push_back(static_cast<std::int32_t>(surface.bodies.size()));
    surface.inverse_mass.push_back(static_cast<float>(body.m_nodes[i].m_im));
  }
  for (int i = 0; i < body.m_faces.size(); ++i) {
    const auto& corners = body.m_faces[i].m_n;
    surface.faces.push_back({vertex_of(corners[0]), vertex_of(corners[1]), vertex_of(corners[2])});
  }
  for (int i = 0; body.m_faces.size() == 0 && i < body.m_links.size(); ++i) {
    const btSoftBody::Link& link = body.m_links[i];
    if (!link.m_bbending) surface.edges.push_back({vertex_of(link.m_n[0]), vertex_of(link.m_n[1])});
  }
  surface.bodies.push_back(filter_of(body));
  surface.bodies.back().self_collision = const_cast<btSoftBody&>(body).useSelfCollision();
}

// Reads the primitives: the nodes of all soft bodies, then the vertices of the solids.
Surface read_primitives(const Application& application) {
  Surface surface;
  for (const auto& body : application.soft_bodies()) add_soft_body(surface, *body);
  for (const Solid& solid : application.solids()) {
    if (!solid.surface) continue;
    const auto first = static_cast<std::int32_t>(surface.body_of_vertex.size());
    for (std::size_t i = 0; i < solid.surface->vertices.size(); ++i) {
      surface.body_of_vertex.push_back(static_cast<std::int32_t>(surface.bodies.size()));
      surface.inverse_mass.push_back(0);
    }
    for (const Face& face : solid.surface->faces)
      surface.faces.push_back({first + face[0], first + face[1], first + face[2]});
    surface.bodies.push_back(filter_of(*solid.object));
    // What is rigid does not meet what is rigid here.
    surface.bodies.back().group = 1u << 31;
    surface.bodies.back().mask = ~(1u << 31);
  }
  return surface;
}

std::vector<btScalar> read_coordinates(const Application& application) {
  std::vector<btScalar> coordinates;
  const auto add = [&](const btVector3& x) {
    for (int k = 0; k < 3; ++k) coordinates.push_back(x[k]);
  };
  for (const auto& body : application.soft_bodies()) {
    for (int i = 0; i < body->m_nodes.size(); ++i) add(body->m_nodes[i].m_x);
  }
  for (const Solid& solid : application.solids()) {
    if (!solid.surface) continue;
    const btTransform& pose = solid.object->getWorldTransform();
    for (const btVector3& vertex : solid.surface->vertices) add(pose * vertex);
  }
  return coordinates;
}

bool all_finite(const std::vector<btScalar>& values) {
  return std::all_of(values.begin(), values.end(), [](btScalar x) { return std::isfinite(x); });
}

}  // namespace

State read_state(const Application& application) {
  State state;
  const double gravity = application.settings().gravity;
  const auto add = [&](double mass, const btVector3& x, const btVector3& v) {
    state.kinetic_energy += 0.5 * mass * static_cast<double>(v.length2());
    state.potential_energy += mass * gravity * static_cast<double>(x.y());
    state.momentum += scalar(mass) * v;
    state.finite &= std::isfinite(x.length2()) && std::isfinite(v.length2());
  };
  for (const auto& body : application.soft_bodies()) {
    for (int i = 0; i < body->m_nodes.size(); ++i) {
      const btSoftBody::Node& node = body->m_nodes[i];
      if (node.m_im > 0) add(1 / static_cast<double>(node.m_im), node.m_x, node.m_v);
    }
    state.fastest_node = std::max(state.fastest_node, fastest_node(*body));
  }
  for (const auto& body : application.rigid_bodies()) {
    if (body->getInvMass() == 0) continue;
    add(1 / static_cast<double>(body->getInvMass()), body->getCenterOfMassPosition(),
        body->getLinearVelocity());
    const btVector3& turning = body->getAngularVelocity();
    const btVector3 spin = body->getInvInertiaTensorWorld().inverse() * turning;
    state.kinetic_energy += 0.5 * static_cast<double>(turning.dot(spin));
  }
  for (const auto& multibody : application.multibodies()) {
    state.kinetic_energy += multibody->kinetic_energy();
    state.potential_energy += multibody->potential_energy(gravity);
  }
  return state;
}

double fastest_node(const btSoftBody& body) {
  btScalar fastest = 0;
  for (int i = 0; i < body.m_nodes.size(); ++i) {
    if (body.m_nodes[i].m_im > 0) fastest = std::max(fastest, body.m_nodes[i].m_v.length());
  }
  return static_cast<double>(fastest);
}

btVector3 middle_of(const btSoftBody& body) {
  btVector3 sum(0, 0, 0);
  for (int i = 0; i < body.m_nodes.size(); ++i) sum += body.m_nodes[i].m_x;
  return sum / static_cast<btScalar>(body.m_nodes.size());
}

double lowest_node(const btSoftBody& body) {
  btScalar lowest = body.m_nodes[0].m_x.y();
  for (int i = 1; i < body.m_nodes.size(); ++i) lowest = std::min(lowest, body.m_nodes[i].m_x.y());
  return static_cast<double>(lowest);
}

double highest_node(const btSoftBody& body) {
  btScalar highest = body.m_nodes[0].m_x.y();
  for (int i = 1; i < body.m_nodes.size(); ++i)
    highest = std::max(highest, body.m_nodes[i].m_x.y());
  return static_cast<double>(highest);
}

double sticking_edges(const Application& application) {
  const std::vector<btScalar> coordinates = read_coordinates(application);
  if (!all_finite(coordinates)) return std::numeric_limits<double>::infinity();
  return static_cast<double>(find_intersections(read_primitives(application), coordinates).size());
}

Observer::Observer(const Application& application)
    : application_(application),
      counter_(read_primitives(application), read_coordinates(application)) {}

void Observer::step(bool jump) {
  std::vector<btScalar> now = read_coordinates(application_);
  if (!all_finite(now)) return;
  if (jump) {
    counter_.jump(std::move(now));
  } else {
    counter_.step(std::move(now));
  }
}

std::int64_t Observer::pass_throughs() const {
  return counter_.vertex_face() + counter_.edge_edge();
}

}  // namespace lazyccd::scenes::behaviour
