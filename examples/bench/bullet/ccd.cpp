#include "bench/bullet/ccd.h"

#include <algorithm>
#include <chrono>
#include <map>
#include <numeric>
#include <utility>

#include "BulletSoftBody/btSoftBodyInternals.h"

namespace lazyccd::bench {
namespace {

// Length of the step, seconds. It matters, because Bullet stores velocities instead of end
// positions and compares roots in seconds with absolute epsilons. This value is from Bullet's
// documentation.
constexpr double time_step = 1.0 / 240;

btVector3 position(const Positions& positions, std::size_t i) {
  const auto p = positions[i];
  return {btScalar(p[0]), btScalar(p[1]), btScalar(p[2])};
}

template <class Data>
btDbvtNode* new_leaf(Data* data) {
  auto* leaf = new (btAlignedAlloc(sizeof(btDbvtNode), 16)) btDbvtNode();
  leaf->parent = nullptr;
  leaf->data = data;
  leaf->childs[1] = nullptr;
  data->m_leaf = leaf;
  return leaf;
}

btDbvtNode* new_parent(btDbvtNode* a, btDbvtNode* b) {
  auto* node = new (btAlignedAlloc(sizeof(btDbvtNode), 16)) btDbvtNode();
  node->parent = nullptr;
  node->childs[0] = a;
  node->childs[1] = b;
  a->parent = b->parent = node;
  return node;
}

using Adjacency = std::vector<std::vector<int>>;

// Builds the tree that btSoftBody::initializeFaceTree builds: it merges neighbours in pairs, level
// by level, in index order. Bullet finds neighbours by comparing all pairs, which takes a minute
// for 80 000 faces. It also never ends if several roots remain that are not neighbours (parts that
// share only a vertex). This function takes the neighbours from a table, and makes consecutive
// remaining roots neighbours of each other.
btDbvtNode* merge_neighbours(std::vector<btDbvtNode*> nodes, Adjacency adjacency) {
  while (nodes.size() > 1) {
    const int count = int(nodes.size());
    std::vector<int> parent_of(count, -1);
    std::vector<btDbvtNode*> parents;
    std::vector<std::array<int, 2>> children;
    for (int i = 0; i < count; ++i) {
      if (parent_of[i] >= 0) continue;
      parent_of[i] = int(parents.size());
      const auto free = std::find_if(adjacency[i].begin(), adjacency[i].end(),
                                     [&](int j) { return parent_of[j] < 0; });
      if (free == adjacency[i].end()) {
        parents.push_back(nodes[i]);
        children.push_back({i, -1});
      } else {
        parent_of[*free] = int(parents.size());
        parents.push_back(new_parent(nodes[i], nodes[*free]));
        children.push_back({i, *free});
      }
    }
    Adjacency next(parents.size());
    for (std::size_t p = 0; p < parents.size(); ++p) {
      for (int child : children[p]) {
        if (child < 0) continue;
        for (int j : adjacency[child])
          if (parent_of[j] != int(p)) next[p].push_back(parent_of[j]);
      }
      std::sort(next[p].begin(), next[p].end());
      next[p].erase(std::unique(next[p].begin(), next[p].end()), next[p].end());
    }
    if (parents.size() == nodes.size())
      for (std::size_t p = 0; p + 1 < parents.size(); ++p) {
        next[p].push_back(int(p) + 1);
        next[p + 1].push_back(int(p));
      }
    nodes = std::move(parents);
    adjacency = std::move(next);
  }
  return nodes.empty() ? nullptr : nodes[0];
}

btDbvntNode* with_normals(const btDbvtNode* node) {
  auto* copy = new btDbvntNode(node);
  if (node->isinternal())
    for (int i = 0; i < 2; ++i) copy->childs[i] = with_normals(node->childs[i]);
  return copy;
}

void build_trees(btSoftBody& body, Span<const Face> faces) {
  std::vector<btDbvtNode*> leaves;
  for (int i = 0; i < body.m_faces.size(); ++i) leaves.push_back(new_leaf(&body.m_faces[i]));
  std::map<std::array<int, 2>, std::vector<int>> faces_of_edge;
  Adjacency face_neighbours(faces.size());
  Adjacency node_neighbours(body.m_nodes.size());
  for (std::size_t f = 0; f < faces.size(); ++f)
    for (int side = 0; side < 3; ++side) {
      const int a = faces[f][side], b = faces[f][(side + 1) % 3];
      auto& others = faces_of_edge[{std::min(a, b), std::max(a, b)}];
      if (others.empty()) {
        node_neighbours[a].push_back(b);
        node_neighbours[b].push_back(a);
      }
      for (int other : others) {
        face_neighbours[f].push_back(other);
        face_neighbours[other].push_back(int(f));
      }
      others.push_back(int(f));
    }
  for (auto& neighbours : face_neighbours) std::sort(neighbours.begin(), neighbours.end());
  body.m_fdbvt.clear();
  body.m_fdbvt.m_root = merge_neighbours(leaves, std::move(face_neighbours));
  body.m_fdbvnt = with_normals(body.m_fdbvt.m_root);

  leaves.clear();
  body.m_ndbvt.clear();
  for (int i = 0; i < body.m_nodes.size(); ++i) leaves.push_back(new_leaf(&body.m_nodes[i]));
  body.m_ndbvt.m_root = merge_neighbours(leaves, std::move(node_neighbours));
}

// Prepares a body as performGeometricCollisions does before it searches for contacts.
void prepare(btSoftBody& body) {
  const btScalar dt = btScalar(time_step);
  body.updateFaceTree(true, false);
  body.updateNodeTree(true, false);
  body.m_faceNodeContactsCCD.clear();
  for (int i = 0; i < body.m_nodes.size(); ++i) {
    btSoftBody::Node& n = body.m_nodes[i];
    n.m_q = n.m_x + dt * n.m_v;
  }
  for (int i = 0; i < body.m_faces.size(); ++i) {
    btSoftBody::Face& f = body.m_faces[i];
    const btSoftBody::Node &a = *f.m_n[0], &b = *f.m_n[1], &c = *f.m_n[2];
    f.m_n0 = (b.m_x - a.m_x).cross(c.m_x - a.m_x);
    f.m_n1 = (b.m_q - a.m_q).cross(c.m_q - a.m_q);
    f.m_vn = (b.m_v - a.m_v).cross(c.m_v - a.m_v) * dt * dt;
  }
}

// A connected component of the mesh. Bullet needs each one as a soft body of its own. `vertices`
// and `faces` are indices of the whole mesh; `corners` of the faces are indices into `vertices`.
struct Component {
  std::vector<int> vertices, faces;
  std::vector<Face> corners;
};

std::vector<Component> components(std::size_t vertex_count, Span<const Face> faces) {
  std::vector<int> root(vertex_count);
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](int v) {
    while (root[v] != v) v = root[v] = root[root[v]];
    return v;
  };
  for (const Face& f : faces)
    for (int i = 1; i < 3; ++i) root[find(f[i])] = find(f[0]);

  std::vector<int> component_of(vertex_count, -1), local(vertex_count, -1);
  std::vector<Component> all;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    int& component = component_of[find(faces[f][0])];
    if (component < 0) {
      component = int(all.size());
      all.emplace_back();
    }
    Component& part = all[component];
    Face corners = faces[f];
    for (std::int32_t& v : corners) {
      if (local[v] < 0) {
        local[v] = int(part.vertices.size());
        part.vertices.push_back(v);
      }
      v = local[v];
    }
    part.faces.push_back(int(f));
    part.corners.push_back(corners);
  }
  return all;
}

}  // namespace

struct BulletCcd::Impl {
  btSoftBodyWorldInfo world;
  std::vector<std::unique_ptr<btSoftBody>> bodies;
};

BulletCcd::BulletCcd(const Positions& start, const Positions& end, Span<const Face> faces)
    : impl_(std::make_unique<Impl>()) {
  for (const Component& part : components(start.count(), faces)) {
    std::vector<btVector3> x;
    for (const int vertex : part.vertices) x.push_back(position(start, std::size_t(vertex)));
    const std::vector<btScalar> mass(x.size(), 1);
    auto body = std::make_unique<btSoftBody>(&impl_->world, int(x.size()), x.data(), mass.data());
    for (int i = 0; i < body->m_nodes.size(); ++i) {
      btSoftBody::Node& n = body->m_nodes[i];
      n.index = part.vertices[std::size_t(i)];
      n.m_v = (position(end, std::size_t(n.index)) - n.m_x) / btScalar(time_step);
    }
    for (std::size_t f = 0; f < part.faces.size(); ++f) {
      const Face& corners = part.corners[f];
      body->appendFace(corners[0], corners[1], corners[2]);
      body->m_faces[int(f)].m_index = part.faces[f];
    }
    body->m_sst.sdt = btScalar(time_step);
    body->setSelfCollision(true);
    body->updateNormals();
    build_trees(*body, part.corners);
    impl_->bodies.push_back(std::move(body));
  }
}

BulletCcd::~BulletCcd() = default;

double BulletCcd::pass() {
  const auto before = std::chrono::steady_clock::now();
  for (const auto& body : impl_->bodies) prepare(*body);
  for (std::size_t i = 0; i < impl_->bodies.size(); ++i)
    for (std::size_t j = i; j < impl_->bodies.size(); ++j)
      impl_->bodies[i]->geometricCollisionHandler(impl_->bodies[j].get());
  const std::chrono::duration<double, std::milli> elapsed =
      std::chrono::steady_clock::now() - before;
  return elapsed.count();
}

std::vector<std::array<std::int32_t, 2>> BulletCcd::contacts() const {
  std::vector<std::array<std::int32_t, 2>> pairs;
  for (const auto& body : impl_->bodies)
    for (int i = 0; i < body->m_faceNodeContactsCCD.size(); ++i) {
      const auto& c = body->m_faceNodeContactsCCD[i];
      pairs.push_back({c.m_node->index, c.m_face->m_index});
    }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

}  // namespace lazyccd::bench
