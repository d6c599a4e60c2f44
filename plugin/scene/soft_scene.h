// Bullet's soft bodies as one index space of vertices, faces and edges.
//
// Taken: bodies with at least one face or one link that counts. A link counts as an edge where one
// of its ends belongs to no face and no tetrahedron (ropes); other links lie on the surface or
// inside the volume, and bending links are not matter. Nodes that no face or edge uses are no
// vertices. Left out, and said once: faces that name a node twice, repeat another face or reach
// into another body; bodies that are reduced deformables or hold a position that is not finite.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "lazyccd/threads.h"
#include "util/warning_log.h"
#include "scene/scene_topology.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

// Index of a node in its body, or -1 where the pointer leads elsewhere.
int index_of(const btSoftBody& body, const btSoftBody::Node* node);
// All its nodes' positions and velocities.
bool is_finite(const btSoftBody& body);

class SoftScene {
 public:
  struct BodyRecord {
    btSoftBody* body;
    int world_index;  // position in the world's array of soft bodies
    std::int32_t first_vertex, vertex_count;
    btScalar margin;  // metres
    bool responds;    // false: contacts are reported and nothing is moved
  };

  // Compares with what was read last, cheaply: counts, filters and Bullet's own mark of a change.
  // Reads everything anew where something differs, and then returns true. Whether the same nodes
  // are pinned is left to whoever reads the nodes anyway.
  bool update(const btAlignedObjectArray<btSoftBody*>& bodies, WarningLog& warnings);
  // Takes the next update() as changed, whatever it sees.
  void invalidate() { valid_ = false; }
  // Leaves a body out until its nodes are finite again.
  void exclude(const btSoftBody* body) { excluded_.push_back(body); }
  void reinclude(const btAlignedObjectArray<btSoftBody*>& bodies);
  bool is_excluded(const btSoftBody* body) const;
  // Not refused, and of a kind that LazyCCD detects.
  bool handles(const btSoftBody* body) const;

  const SceneTopology& topology() const { return topology_; }
  std::int32_t vertex_count() const { return topology_.vertex_count(); }
  const std::vector<BodyRecord>& bodies() const { return bodies_; }
  std::int32_t body_of(std::int32_t vertex) const { return topology_.body_of_vertex[vertex]; }
  btSoftBody::Node& node(std::int32_t vertex) const {
    return bodies_[body_of(vertex)].body->m_nodes[node_[vertex]];
  }
  bool was_pinned(std::int32_t vertex) const { return !(topology_.inverse_mass[vertex] > 0); }
  int node_index(std::int32_t vertex) const { return node_[vertex]; }
  // Calls visit(record, first, last) over disjoint ranges of all vertices, each of one body, perhaps
  // on several threads.
  using Visit =
      std::function<void(const BodyRecord& record, std::int32_t first, std::int32_t last)>;
  void for_each_range(const Threads& threads, const Visit& visit) const;
  // For loops over a body's vertices: asks for the node of a later one, because Bullet's nodes lie
  // further apart than processors look ahead.
  void fetch_ahead(const BodyRecord& record, std::int32_t vertex) const {
#if defined(__GNUC__)
    constexpr std::int32_t ahead = 24;
    constexpr int line = 64, read = 3 * line;  // bytes; what is read lies in the first of a node
    if (vertex + ahead >= record.first_vertex + record.vertex_count) return;
    const char* node = reinterpret_cast<const char*>(&record.body->m_nodes[node_[vertex + ahead]]);
    for (int at = 0; at < read; at += line) __builtin_prefetch(node + at);
#endif
  }
  // The vertex of a node, or -1 where no face or edge uses the node.
  std::int32_t vertex_of(const BodyRecord& record, int node) const;
  // Bullet's face behind a face of topology().
  btSoftBody::Face& face(std::int32_t face) const {
    return bodies_[body_of(topology_.faces[face][0])].body->m_faces[face_[face]];
  }

 private:
  // What a change of the scene shows in without reading its faces.
  struct Fingerprint {
    const btSoftBody* body;
    const btSoftBody::Node* nodes;
    std::uint64_t ignored;  // over the lists of objects not to collide with
    int node_count, face_count, link_count, tetra_count;
    int group, mask, collisions;
    bool self, responds, excluded, marked_changed;
    btScalar margin;
    bool operator==(const Fingerprint& s) const;
  };

  Fingerprint fingerprint(btSoftBody* body) const;
  void rebuild(const btAlignedObjectArray<btSoftBody*>& bodies, WarningLog& warnings);
  void add_body(btSoftBody* body, int world_index, WarningLog& warnings);
  void find_filters();

  bool valid_ = false;
  std::vector<Fingerprint> fingerprints_;
  std::vector<const btSoftBody*> excluded_;

  std::vector<BodyRecord> bodies_;
  SceneTopology topology_;
  std::vector<int> node_;  // index in its body, by vertex
  std::vector<int> face_;  // index in its body, by face
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
