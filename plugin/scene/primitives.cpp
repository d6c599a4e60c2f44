#include "scene/primitives.h"

#include <algorithm>
#include <array>
#include <utility>

#include "util/soft_body_nodes.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

void read_faces(const btSoftBody& body, Primitives& p) {
  for (int i = 0; i < body.m_faces.size(); ++i) {
    Face face;
    for (int k = 0; k < 3; ++k) face[k] = index_of(body, body.m_faces[i].m_n[k]);
    if (std::min({face[0], face[1], face[2]}) < 0) {
      ++p.foreign_faces;
    } else if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) {
      ++p.degenerate_faces;
    } else {
      p.faces.push_back(face);
      p.face_indices.push_back(i);
    }
  }
}

void leave_out_duplicates(Primitives& p) {
  std::vector<std::pair<Face, std::size_t>> sorted;
  for (std::size_t i = 0; i < p.faces.size(); ++i) {
    Face face = p.faces[i];
    std::sort(face.begin(), face.end());
    sorted.emplace_back(face, i);
  }
  std::sort(sorted.begin(), sorted.end());
  std::vector<char> keep(p.faces.size(), 1);
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    if (sorted[i].first == sorted[i - 1].first) keep[sorted[i].second] = 0;
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < keep.size(); ++i) {
    if (!keep[i]) continue;
    p.faces[kept] = p.faces[i];
    p.face_indices[kept++] = p.face_indices[i];
  }
  p.duplicate_faces = static_cast<int>(p.faces.size() - kept);
  p.faces.resize(kept);
  p.face_indices.resize(kept);
}

// The corners of a tetrahedron as indices of nodes; -1 for a node of another body.
std::array<int, 4> corners(const btSoftBody& body, const btSoftBody::Tetra& tetra) {
  std::array<int, 4> nodes{};
  for (std::size_t k = 0; k < nodes.size(); ++k) nodes[k] = index_of(body, tetra.m_n[k]);
  return nodes;
}

void read_links(const btSoftBody& body, Primitives& p) {
  std::vector<char> covered(body.m_nodes.size(), 0);
  for (const Face& face : p.faces) {
    for (const std::int32_t node : face) covered[node] = 1;
  }
  for (int i = 0; i < body.m_tetras.size(); ++i) {
    for (const int node : corners(body, body.m_tetras[i]))
      if (node >= 0) covered[node] = 1;
  }
  for (int i = 0; i < body.m_links.size(); ++i) {
    const btSoftBody::Link& link = body.m_links[i];
    if (link.m_bbending) continue;
    const Edge edge = {index_of(body, link.m_n[0]), index_of(body, link.m_n[1])};
    if (edge[0] < 0 || edge[1] < 0 || edge[0] == edge[1]) continue;
    if (!covered[edge[0]] || !covered[edge[1]]) p.edges.push_back(edge);
  }
}

// Adds sides of tetrahedra until each node is at a face or an edge. First those that serve two
// nodes.
void add_edges_to_inner_nodes(const btSoftBody& body, Primitives& p) {
  std::vector<char> used(body.m_nodes.size(), 0);
  for (const Face& face : p.faces)
    for (const std::int32_t node : face) used[node] = 1;
  for (const Edge& edge : p.edges) used[edge[0]] = used[edge[1]] = 1;
  const auto add = [&](int a, int b) {
    if (a < 0 || b < 0 || a == b) return;
    p.edges.push_back({a, b});
    used[a] = used[b] = 1;
  };
  for (int i = 0; i < body.m_tetras.size(); ++i) {
    const std::array<int, 4> nodes = corners(body, body.m_tetras[i]);
    for (const int a : nodes)
      for (const int b : nodes)
        if (a >= 0 && b >= 0 && !used[a] && !used[b]) add(a, b);
  }
  for (int i = 0; i < body.m_tetras.size(); ++i) {
    const std::array<int, 4> nodes = corners(body, body.m_tetras[i]);
    for (const int a : nodes)
      for (const int b : nodes)
        if (a >= 0 && !used[a]) add(a, b);
  }
}

}  // namespace

Primitives read_primitives(const btSoftBody& body) {
  Primitives p;
  read_faces(body, p);
  leave_out_duplicates(p);
  read_links(body, p);
  if (!p.faces.empty()) add_edges_to_inner_nodes(body, p);
  return p;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
