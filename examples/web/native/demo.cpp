#include "demo.h"

#include <cmath>

namespace lazyccd::web {

using namespace scenes;

namespace {

constexpr btScalar counted_size(0.95);

void append(const btVector3& x, std::vector<float>& positions) {
  for (int k = 0; k < 3; ++k) positions.push_back(static_cast<float>(x[k]));
}

}  // namespace

Demo::Demo(const SceneInfo& info, Collisions collisions, double speed, double size)
    : scene_(set_up(info, collisions, speed, size)) {
  // What is counted: what read_surface() gives, and the convex bodies, which it leaves out.
  Surface surface = read_surface(*scene_.world);
  for (const RigidBody& rigid : world().rigid_bodies()) {
    if (rigid.is_mesh()) continue;
    const auto first = static_cast<std::int32_t>(surface.body_of_vertex.size());
    surface.body_of_vertex.insert(surface.body_of_vertex.end(), rigid.surface.vertices.size(),
                                  static_cast<std::int32_t>(surface.bodies.size()));
    surface.inverse_mass.insert(surface.inverse_mass.end(), rigid.surface.vertices.size(),
                                rigid.body->isStaticOrKinematicObject() ? 0.0f : 1.0f);
    for (const Face& face : rigid.surface.faces)
      surface.faces.push_back({first + face[0], first + face[1], first + face[2]});
    surface.bodies.emplace_back();
  }
  counter_ = std::make_unique<CrossingCounter>(surface, counted_positions());

  for (const auto& body : world().bodies()) {
    Drawn drawn;
    drawn.is_soft = true;
    for (int i = 0; i < body->m_faces.size(); ++i)
      for (const btSoftBody::Node* const node : body->m_faces[i].m_n)
        drawn.faces.push_back(static_cast<std::int32_t>(node - &body->m_nodes[0]));
    drawn_.push_back(std::move(drawn));
  }
  for (const RigidBody& rigid : world().rigid_bodies()) {
    Drawn drawn;
    for (const Face& face : rigid.surface.faces)
      drawn.faces.insert(drawn.faces.end(), face.begin(), face.end());
    drawn_.push_back(std::move(drawn));
  }
  draw();
}

void Demo::step() {
  const auto rate = static_cast<btScalar>(0.25 / world().options().dt);  // 1/s
  constexpr btScalar fastest(4);                                         // m/s
  if (!grabbed_.empty()) {
    btVector3 velocity = (goal_ - grabbed_[0]->m_x) * rate;
    if (velocity.length() > fastest) velocity *= fastest / velocity.length();
    for (btSoftBody::Node* const node : grabbed_)
      if (node->m_im > 0) node->m_v = velocity;
  }
  scene_.world->step();
}

std::int64_t Demo::count() {
  counter_->step(counted_positions());
  return counter_->vertex_face() + counter_->edge_edge();
}

std::vector<btScalar> Demo::counted_positions() const {
  std::vector<btScalar> positions = read_positions(world());
  for (const RigidBody& rigid : world().rigid_bodies()) {
    if (rigid.is_mesh()) continue;
    for (const btVector3& vertex : rigid.surface.vertices) {
      const btVector3 x = rigid.body->getWorldTransform() * (vertex * counted_size);
      positions.insert(positions.end(), {x.x(), x.y(), x.z()});
    }
  }
  return positions;
}

bool Demo::is_finite() const {
  for (const auto& body : world().bodies())
    for (int i = 0; i < body->m_nodes.size(); ++i)
      if (!std::isfinite(body->m_nodes[i].m_x.length2())) return false;
  return true;
}

void Demo::draw() {
  std::size_t next = 0;
  for (const auto& body : world().bodies()) {
    std::vector<float>& positions = drawn_[next++].positions;
    positions.clear();
    for (int i = 0; i < body->m_nodes.size(); ++i) append(body->m_nodes[i].m_x, positions);
  }
  for (const RigidBody& rigid : world().rigid_bodies()) {
    std::vector<float>& positions = drawn_[next++].positions;
    positions.clear();
    for (const btVector3& vertex : rigid.surface.vertices)
      append(rigid.body->getWorldTransform() * vertex, positions);
  }
}

const std::vector<float>& Demo::contact_lines() {
  constexpr btScalar length(0.05);
  lines_.clear();
  for (const bullet::StepContact& contact : world().contacts()) {
    if (contact.impulse <= 0) continue;
    append(contact.point, lines_);
    append(contact.point + length * contact.normal, lines_);
  }
  return lines_;
}

void Demo::grab(int soft_body, int node) {
  btSoftBody& body = *world().bodies()[soft_body];
  btSoftBody::Node* const middle = &body.m_nodes[node];
  grabbed_ = {middle};
  for (int i = 0; i < body.m_links.size(); ++i) {
    const auto& ends = body.m_links[i].m_n;
    if (ends[0] == middle || ends[1] == middle) grabbed_.push_back(ends[ends[0] == middle]);
  }
  goal_ = middle->m_x;
}

}  // namespace lazyccd::web
