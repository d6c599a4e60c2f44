#include "world/soft_body_dbvt.h"

#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <random>

#include "bodies/side_by_side.h"
#include "util/disjoint_sets.h"
#include "util/scratch_vector.h"
#include "util/soft_body_nodes.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// True if the body is one component in the way that Bullet builds its trees bottom-up: faces joined
// by common sides, and nodes joined by links.
bool is_connected(const btSoftBody& body) {
  if (body.m_faces.size() == 0 || !has_own_faces(body) || !has_own_links(body)) return false;
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

// True if a collision of `body` with `other` reads the face tree, as in
// btSoftBody::defaultCollisionHandler().
bool reads_faces(const btSoftBody& body, const btCollisionObject& other) {
  using Flag = btSoftBody::fCollision;
  if (!(body.m_cfg.collisions & Flag::SDF_RD)) return false;
  const int type = other.getInternalType();
  return (type == btCollisionObject::CO_RIGID_BODY && (body.m_cfg.collisions & Flag::SDF_RDF)) ||
         (type == btCollisionObject::CO_FEATHERSTONE_LINK &&
          (body.m_cfg.collisions & Flag::SDF_MDF));
}

// Builds the face tree with Bullet's own btDbvt, in the state in which Bullet leaves it at the
// start of a step.
void build_faces(btSoftBody& body) {
  std::vector<int> order(static_cast<std::size_t>(body.m_faces.size()));
  std::iota(order.begin(), order.end(), 0);
  // Faces inserted row by row would make the tree as deep as there are rows.
  std::shuffle(order.begin(), order.end(), std::minstd_rand());
  for (const int i : order) {
    btSoftBody::Face& face = body.m_faces[i];
    const btVector3* corners[] = {&face.m_n[0]->m_x, &face.m_n[1]->m_x, &face.m_n[2]->m_x};
    face.m_leaf = body.m_fdbvt.insert(btDbvtVolume::FromPoints(corners, 3), &face);
  }
  body.m_fdbvt.optimizeTopDown(8);  // subtrees of this size are merged pair by pair, in cubic time
  body.updateFaceTree(true, true);
}

// Copies a face tree into one with normals.
btDbvntNode* copy(const btDbvtNode* node) {
  auto* const copied = new btDbvntNode(node);
  for (int k = 0; k < 2 && node->isinternal(); ++k) copied->childs[k] = copy(node->childs[k]);
  return copied;
}

// Builds the face tree, and the one with normals.
void build_both_face_trees(btSoftBody& body) {
  if (is_connected(body)) {
    body.initializeFaceTree();
    return;
  }
  if (body.m_fdbvt.empty() && is_finite(body)) build_faces(body);
  if (body.m_fdbvt.m_root && !body.m_fdbvnt) body.m_fdbvnt = copy(body.m_fdbvt.m_root);
}

}  // namespace

void SoftBodyDbvt::begin_prediction(Bodies& bodies, int request_flag, bool bullet_handles_pairs) {
  request_flag_ = request_flag;
  for (int i = 0; i < bodies.size(); ++i) {
    btSoftBody* const body = bodies[i];
    if (bullet_handles_pairs) update_node_tree(*body);
    if (!(body->m_cfg.collisions & request_flag)) continue;
    // Request the tree if it was left out in an earlier step.
    if (bullet_handles_pairs && body->m_fdbvt.empty() && is_connected(*body))
      body->m_bUpdateRtCst = true;
    if (!body->m_bUpdateRtCst) continue;
    const bool is_read = bullet_handles_pairs || body->m_fdbvnt;
    if (is_read && is_connected(*body)) continue;
    // Bullet's tree refers to faces that may have moved in memory.
    delete body->m_fdbvnt;
    body->m_fdbvnt = nullptr;
    body->m_cfg.collisions &= ~request_flag;
    suspended_requests_.push_back(body);
  }
}

void SoftBodyDbvt::hide_nodes(Bodies& bodies) {
  ScratchVector<btSoftBody*> left_out;
  for (int i = 0; i < bodies.size(); ++i) {
    // When Bullet builds the face tree, it also builds the node tree again.
    if (bodies[i]->m_bUpdateRtCst && (bodies[i]->m_cfg.collisions & request_flag_)) continue;
    hidden_.push_back({bodies[i], bodies[i]->m_ndbvt.m_root});
    bodies[i]->m_ndbvt.m_root = nullptr;
    left_out.push_back(bodies[i]);
  }
  leave_out_nodes(left_out);
}

void SoftBodyDbvt::end_prediction() {
  for (btSoftBody* body : suspended_requests_) body->m_cfg.collisions |= request_flag_;
  suspended_requests_.clear();
  for (const Hidden& hidden : hidden_) hidden.body->m_ndbvt.m_root = hidden.root;
  hidden_.clear();
}

void SoftBodyDbvt::update_node_tree(btSoftBody& body) {
  outdated_node_trees_.insert(left_out_.begin(), left_out_.end());
  left_out_.clear();
  if (outdated_node_trees_.erase(&body) > 0) body.updateNodeTree(true, true);
}

void SoftBodyDbvt::update_trees(btSoftBody& body, const btCollisionObject& other) {
  update_node_tree(body);
  // Another solver may have left it out. If it is requested, Bullet builds it in the next
  // prediction.
  const bool is_missing = body.m_fdbvt.empty() && body.m_faces.size() > 0 && !body.m_bUpdateRtCst;
  if (is_missing && reads_faces(body, other) && is_finite(body)) build_faces(body);
}

void SoftBodyDbvt::update_trees(btSoftBody& a, btSoftBody& b) {
  // As in btSoftBody::defaultCollisionHandler(). Clusters have a tree of their own.
  using Flag = btSoftBody::fCollision;
  if (!(a.m_cfg.collisions & b.m_cfg.collisions & (Flag::VF_SS | Flag::VF_DD))) return;
  update_node_tree(a);
  update_node_tree(b);
}

void SoftBodyDbvt::build_trees(btSoftBody& body, int request_flag) {
  if (body.m_bUpdateRtCst) return;
  const bool is_requested = (body.m_cfg.collisions & request_flag) && body.m_faces.size() > 0;
  if (is_requested && (body.m_fdbvt.empty() || !body.m_fdbvnt)) build_both_face_trees(body);
  body.updateNodeTree(true, true);
  body.updateFaceTree(true, true);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
