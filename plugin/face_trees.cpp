#include "face_trees.h"

#include <numeric>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

bool hangs_together(const btSoftBody& body) {
  std::vector<int> parent(static_cast<std::size_t>(body.m_nodes.size()));
  std::iota(parent.begin(), parent.end(), 0);
  const auto find = [&](const btSoftBody::Node* node) {
    int i = static_cast<int>(node - &body.m_nodes[0]);
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  int components = 0;
  std::vector<char> seen(parent.size(), 0);
  for (int f = 0; f < body.m_faces.size(); ++f) {
    const auto& corners = body.m_faces[f].m_n;
    for (const btSoftBody::Node* corner : corners) {
      char& old = seen[static_cast<std::size_t>(corner - &body.m_nodes[0])];
      components += !old;
      old = 1;
    }
    for (int k = 1; k < 3; ++k) {
      const int a = find(corners[0]), b = find(corners[k]);
      components -= a != b;
      parent[a] = b;
    }
  }
  return components == 1;
}

}  // namespace

FaceTreesLeftOut::FaceTreesLeftOut(btAlignedObjectArray<btSoftBody*>& bodies, int request,
                                   bool bullets_pairs)
    : request_(request) {
  for (int i = 0; i < bodies.size(); ++i) {
    btSoftBody* const body = bodies[i];
    if (!(body->m_cfg.collisions & request) || body->m_faces.size() == 0) continue;
    // One that was left out before is made up for.
    if (bullets_pairs && body->m_fdbvt.empty()) body->m_bUpdateRtCst = true;
    if (!body->m_bUpdateRtCst) continue;
    const bool is_read = bullets_pairs || body->m_fdbvnt ||
                         (body->m_cfg.collisions & btSoftBody::fCollision::SDF_RDF);
    if (is_read && hangs_together(*body)) continue;
    body->m_cfg.collisions &= ~request;
    bodies_.push_back(body);
  }
}

FaceTreesLeftOut::~FaceTreesLeftOut() {
  for (btSoftBody* body : bodies_) body->m_cfg.collisions |= request_;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
