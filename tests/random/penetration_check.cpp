#include "random/penetration_check.h"

#include <algorithm>
#include <cmath>

#include "scenes/measures/intersections.h"

namespace lazyccd::test {
namespace {

constexpr std::uint32_t soft_group = 1, rigid_group = 2;

using Flag = btSoftBody::fCollision;

bool passes_masks(const btCollisionObject& a, const btCollisionObject& b) {
  const btBroadphaseProxy *p = a.getBroadphaseHandle(), *q = b.getBroadphaseHandle();
  return !p || !q ||
         ((p->m_collisionFilterGroup & q->m_collisionFilterMask) &&
          (q->m_collisionFilterGroup & p->m_collisionFilterMask));
}

bool is_disabled(const btSoftBody& body, const btCollisionObject& other) {
  const auto& disabled = body.m_collisionDisabledObjects;
  return disabled.findLinearSearch(&other) != disabled.size();
}

bool may_meet(const btSoftBody& a, const btSoftBody& b) {
  const int common = a.m_cfg.collisions & b.m_cfg.collisions;
  const bool asked = common & (Flag::VF_SS | Flag::VF_DD);
  return a.hasContactResponse() && b.hasContactResponse() &&
         (&a == &b || (asked && !(common & Flag::CL_SS) && passes_masks(a, b)));
}

// False for a body that is anchored to b: its anchored nodes may lie inside b and would count.
bool may_meet(const btSoftBody& a, const btCollisionObject& b) {
  for (int i = 0; i < a.m_anchors.size(); ++i) {
    if (a.m_anchors[i].m_body == &b) return false;
  }
  for (int i = 0; i < a.m_deformableAnchors.size(); ++i) {
    if (a.m_deformableAnchors[i].m_cti.m_colObj == &b) return false;
  }
  const int flags = a.m_cfg.collisions;
  const int faces = b.getInternalType() == btCollisionObject::CO_FEATHERSTONE_LINK ? Flag::SDF_MDF
                                                                                   : Flag::SDF_RDF;
  const bool asked =
      (flags & Flag::SDF_RS) || ((flags & Flag::SDF_RD) && (flags & (Flag::SDF_RDN | faces)));
  return a.hasContactResponse() && b.hasContactResponse() && asked && !(flags & Flag::CL_RS) &&
         passes_masks(a, b) && !is_disabled(a, b);
}

}  // namespace

void PenetrationCheck::read() {
  surface_ = scenes::Surface();
  driven_.assign(soft_->size(), 0);
  const auto add_vertex = [this](double inverse_mass) {
    surface_.body_of_vertex.push_back(static_cast<std::int32_t>(surface_.bodies.size()));
    surface_.inverse_mass.push_back(static_cast<float>(inverse_mass));
  };
  for (const auto& body : *soft_) {
    const auto first = static_cast<std::int32_t>(surface_.body_of_vertex.size());
    const auto vertex_of = [&](const btSoftBody::Node* node) {
      return first + static_cast<std::int32_t>(node - &body->m_nodes[0]);
    };
    for (int i = 0; i < body->m_nodes.size(); ++i)
      add_vertex(static_cast<double>(body->m_nodes[i].m_im));
    for (int i = 0; i < body->m_faces.size(); ++i) {
      const auto& corners = body->m_faces[i].m_n;
      surface_.faces.push_back(
          {vertex_of(corners[0]), vertex_of(corners[1]), vertex_of(corners[2])});
    }
    for (int i = 0; body->m_faces.size() == 0 && i < body->m_links.size(); ++i) {
      const btSoftBody::Link& link = body->m_links[i];
      if (!link.m_bbending)
        surface_.edges.push_back({vertex_of(link.m_n[0]), vertex_of(link.m_n[1])});
    }
    surface_.bodies.push_back({soft_group, soft_group | rigid_group, body->useSelfCollision()});
  }
  for (const Obstacle& obstacle : obstacles_) {
    const auto first = static_cast<std::int32_t>(surface_.body_of_vertex.size());
    for (std::size_t i = 0; i < obstacle.surface->vertices.size(); ++i)
      add_vertex(obstacle.body->isStaticOrKinematicObject() ? 0 : 1);
    for (Face face : obstacle.surface->faces) {
      for (std::int32_t& corner : face) corner += first;
      surface_.faces.push_back(face);
    }
    surface_.bodies.push_back({rigid_group, soft_group, false});
    driven_.push_back(obstacle.driven);
  }
  read_pairs();
}

void PenetrationCheck::read_pairs() {
  const std::size_t soft = soft_->size(), all = soft + obstacles_.size();
  meet_.assign(all, std::vector<char>(all, 0));
  for (std::size_t a = 0; a < soft; ++a) {
    for (std::size_t b = 0; b < all; ++b) {
      meet_[a][b] = meet_[b][a] = b < soft ? may_meet(*(*soft_)[a], *(*soft_)[b])
                                           : may_meet(*(*soft_)[a], *obstacles_[b - soft].body);
    }
  }
}

std::vector<btScalar> PenetrationCheck::positions() const {
  std::vector<btScalar> result;
  const auto add = [&result](const btVector3& x) {
    for (int k = 0; k < 3; ++k) result.push_back(x[k]);
  };
  for (const auto& body : *soft_) {
    for (int i = 0; i < body->m_nodes.size(); ++i) add(body->m_nodes[i].m_x);
  }
  for (const Obstacle& obstacle : obstacles_) {
    for (const btVector3& x : obstacle.surface->vertices)
      add(obstacle.body->getWorldTransform() * x);
  }
  return result;
}

bool PenetrationCheck::is_clean(const SoftBodies& soft, const std::vector<Obstacle>& obstacles) {
  for (const auto& body : soft) {
    for (int i = 0; i < body->m_nodes.size(); ++i) {
      if (!std::isfinite(body->m_nodes[i].m_x.length2())) return false;
    }
  }
  PenetrationCheck penetration_check;
  penetration_check.restart(soft, obstacles);
  return penetration_check.step().sum() == 0 && penetration_check.intersections().sum() == 0;
}

void PenetrationCheck::restart(const SoftBodies& soft, std::vector<Obstacle> obstacles) {
  soft_ = &soft;
  obstacles_ = std::move(obstacles);
  read();
  detector_.set_topology(surface_.topology());
  last_ = positions();
}

PenetrationCheck::Count PenetrationCheck::step() {
  std::vector<btScalar> now = positions();
  const std::size_t count = now.size() / 3;
  const Span<const Contact> contacts =
      detector_.detect(Positions(last_.data(), count), Positions(now.data(), count));
  crossings_.assign(contacts.begin(), contacts.end());
  last_.swap(now);
  Count result;
  for (const Contact& contact : crossings_) add(contact.body_a, contact.body_b, result);
  return result;
}

void PenetrationCheck::add(std::int32_t body_a, std::int32_t body_b, Count& count) const {
  if (!meet_[static_cast<std::size_t>(body_a)][static_cast<std::size_t>(body_b)]) return;
  ++(driven_[body_a] || driven_[body_b] ? count.with_driven : count.others);
}

PenetrationCheck::Count PenetrationCheck::intersections() const {
  const auto moves = [this](std::int32_t v) { return surface_.inverse_mass[v] > 0; };
  Count result;
  for (const scenes::Intersection& p : scenes::find_intersections(surface_, last_)) {
    if (std::any_of(p.edge.begin(), p.edge.end(), moves) ||
        std::any_of(p.face.begin(), p.face.end(), moves))
      add(surface_.body_of_vertex[p.edge[0]], surface_.body_of_vertex[p.face[0]], result);
  }
  return result;
}

}  // namespace lazyccd::test
