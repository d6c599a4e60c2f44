#include "world/soft_body_dbvt.h"

#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <random>

#include "scene/soft_scene.h"
#include "util/disjoint_sets.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// As Bullet joins them, bottom-up: faces over common sides, and nodes over links.
bool hangs_together(const btSoftBody& body) {
  if (body.m_faces.size() == 0) return false;
  const auto index = [&body](const btSoftBody::Node* node) {
    return static_cast<int>(node - &body.m_nodes[0]);
  };
  DisjointSets nodes(static_cast<std::size_t>(body.m_nodes.size()));
  for (int i = 0; i < body.m_links.size(); ++i)
    nodes.join(index(body.m_links[i].m_n[0]), index(body.m_links[i].m_n[1]));
  if (nodes.count() != 1) return false;
  DisjointSets faces(static_cast<std::size_t>(body.m_faces.size()));
  std::map<std::array<int, 2>, int> face_of_side;
  for (int f = 0; f < body.m_faces.size(); ++f) {
    const auto& corners = body.m_faces[f].m_n;
    for (int k = 0; k < 3; ++k) {
      std::array<int, 2> side = {index(corners[k]), index(corners[(k + 1) % 3])};
      std::sort(side.begin(), side.end());
      faces.join(f, face_of_side.insert({side, f}).first->second);
    }
  }
  return faces.count() == 1;
}

// As btSoftBody::defaultCollisionHandler() does.
bool reads_faces(const btSoftBody& body, const btCollisionObject& other) {
  using Flag = btSoftBody::fCollision;
  if (!(body.m_cfg.collisions & Flag::SDF_RD)) return false;
  const int type = other.getInternalType();
  return (type == btCollisionObject::CO_RIGID_BODY && (body.m_cfg.collisions & Flag::SDF_RDF)) ||
         (type == btCollisionObject::CO_FEATHERSTONE_LINK &&
          (body.m_cfg.collisions & Flag::SDF_MDF));
}

// With Bullet's own structure, and as Bullet leaves it where a step begins.
void build_faces(btSoftBody& body) {
  std::vector<int> order(static_cast<std::size_t>(body.m_faces.size()));
  std::iota(order.begin(), order.end(), 0);
  // Row by row it would grow as deep as there are rows.
  std::shuffle(order.begin(), order.end(), std::minstd_rand());
  for (const int i : order) {
    btSoftBody::Face& face = body.m_faces[i];
    const btVector3* corners[] = {&face.m_n[0]->m_x, &face.m_n[1]->m_x, &face.m_n[2]->m_x};
    face.m_leaf = body.m_fdbvt.insert(btDbvtVolume::FromPoints(corners, 3), &face);
  }
  body.m_fdbvt.optimizeTopDown(8);  // leaves that are merged pair by pair, in cubic time
  body.updateFaceTree(true, true);
}

// Whether it was there.
bool take_out(std::vector<btSoftBody*>& list, const btSoftBody* body) {
  const auto at = std::find(list.begin(), list.end(), body);
  if (at == list.end()) return false;
  list.erase(at);
  return true;
}

}  // namespace

void SoftBodyDbvt::begin_prediction(Bodies& bodies, int request, bool bullets_pairs) {
  request_ = request;
  // Of bodies that are gone.
  if (faceless_.size() > static_cast<std::size_t>(bodies.size())) {
    const auto is_gone = [&](btSoftBody* body) {
      return bodies.findLinearSearch(body) == bodies.size();
    };
    faceless_.erase(std::remove_if(faceless_.begin(), faceless_.end(), is_gone), faceless_.end());
  }
  for (int i = 0; i < bodies.size(); ++i) {
    btSoftBody* const body = bodies[i];
    if (bullets_pairs) bring_up_to_date(*body, nullptr);
    if (!(body->m_cfg.collisions & request)) continue;
    // One that was left out before is made up for.
    if (bullets_pairs && body->m_fdbvt.empty() && hangs_together(*body))
      body->m_bUpdateRtCst = true;
    if (!body->m_bUpdateRtCst) continue;
    take_out(faceless_, body);
    const bool is_read = bullets_pairs || body->m_fdbvnt;
    if (is_read && hangs_together(*body)) continue;
    // Of faces that may be elsewhere now.
    delete body->m_fdbvnt;
    body->m_fdbvnt = nullptr;
    body->m_cfg.collisions &= ~request;
    asking_.push_back(body);
    faceless_.push_back(body);
  }
}

void SoftBodyDbvt::hide_nodes(Bodies& bodies) {
  old_nodes_.clear();
  for (int i = 0; i < bodies.size(); ++i) {
    // With that of faces Bullet builds the one of nodes anew.
    if (bodies[i]->m_bUpdateRtCst && (bodies[i]->m_cfg.collisions & request_)) continue;
    hidden_.push_back({bodies[i], bodies[i]->m_ndbvt.m_root});
    bodies[i]->m_ndbvt.m_root = nullptr;
    old_nodes_.push_back(bodies[i]);
  }
}

void SoftBodyDbvt::end_prediction() {
  for (btSoftBody* body : asking_) body->m_cfg.collisions |= request_;
  asking_.clear();
  for (const Hidden& hidden : hidden_) hidden.body->m_ndbvt.m_root = hidden.root;
  hidden_.clear();
}

void SoftBodyDbvt::bring_up_to_date(btSoftBody& body, const btCollisionObject* other) {
  if (take_out(old_nodes_, &body)) body.updateNodeTree(true, true);
  if (!other || !reads_faces(body, *other) || !is_finite(body) || !take_out(faceless_, &body))
    return;
  if (body.m_fdbvt.empty()) build_faces(body);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
