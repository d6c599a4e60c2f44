// Bullet's soft bodies as one index space of vertices, faces and edges.
//
// Included are bodies with at least one face or one edge (primitives.h) whose collision flags ask
// for a contact. A node is a vertex if a face or edge uses it. Left out, with one warning: faces
// with a repeated node, duplicate faces, faces with a node of another body; bodies that are reduced
// deformables or lost (excluded_bodies.h).
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "exclusion/excluded_bodies.h"
#include "lazyccd/threads.h"
#include "scene/collision_filters.h"
#include "scene/primitives.h"
#include "scene/scene_topology.h"
#include "scene/sleepers.h"
#include "util/refused_pairs.h"
#include "util/scratch_vector.h"
#include "util/soft_body_nodes.h"
#include "util/warning_log.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class SoftScene {
 public:
  struct BodyRecord {
    btSoftBody* body;
    int world_index;  ///< position in the world's array of soft bodies
    std::int32_t first_vertex, vertex_count;
    btScalar margin;          ///< collision margin, metres; 0 if not finite
    bool responds;            ///< false: contacts are reported, but nothing is moved
    bool meets_rigid;         ///< its collision flags ask for something rigid
    IndexRange faces, edges;  ///< in topology()
  };

  explicit SoftScene(CollisionFlags flags) : flags_(flags) {}

  /// Compares the bodies with the last update by cheap signs: counts, filters and Bullet's own mark
  /// of a change (m_bUpdateRtCst). If something differs, reads everything again and returns true.
  /// Does not check which nodes are pinned; the caller does when it reads the nodes.
  bool update(const Sleepers& sleepers, WarningLog& warnings);
  /// True if update() found the body new or changed since forget_changes(). A body that only slept
  /// is not.
  bool is_changed(const btSoftBody& body) const { return changed_.count(&body) > 0; }
  void forget_changes() { changed_.clear(); }
  /// Makes the next update() read everything again.
  void invalidate() {
    valid_ = false;
    primitives_.clear();
  }
  /// The same because of one body, which has changed.
  void invalidate(const btSoftBody& body);
  ExcludedBodies& excluded() { return excluded_; }
  const ExcludedBodies& excluded() const { return excluded_; }
  /// True if the body has faces or links, is no reduced deformable and is not excluded.
  bool accepts(const btSoftBody* body) const;

  const CollisionFlags& flags() const { return flags_; }
  RefusedPairs& refused_pairs() { return refused_pairs_; }
  const RefusedPairs& refused_pairs() const { return refused_pairs_; }
  /// Position of a body in the world's array of soft bodies at the last update(), or -1.
  int world_index_of(const btSoftBody& body) const;
  const SceneTopology& topology() const { return topology_; }
  std::int32_t vertex_count() const { return topology_.vertex_count(); }
  const std::vector<BodyRecord>& bodies() const { return bodies_; }
  std::int32_t body_of(std::int32_t vertex) const { return topology_.body_of_vertex[vertex]; }
  btSoftBody::Node& node(std::int32_t vertex) const {
    return bodies_[body_of(vertex)].body->m_nodes[node_of_vertex_[vertex]];
  }
  bool was_pinned(std::int32_t vertex) const { return !(topology_.inverse_mass[vertex] > 0); }
  int node_index(std::int32_t vertex) const { return node_of_vertex_[vertex]; }
  /// Called with a range [first, last) of vertices of one body.
  using Visit = FunctionRef<void(const BodyRecord& record, std::int32_t first, std::int32_t last)>;
  /// Calls visit(record, first, last) for disjoint ranges that cover all vertices. Several threads
  /// may call it at the same time.
  void for_each_range(const Threads& threads, Visit visit) const;
  /// Prefetches the node of a later vertex, for loops over a body's vertices. Bullet's nodes lie
  /// too far apart for the processor's own prefetcher.
  void prefetch_node(const BodyRecord& record, std::int32_t vertex) const {
#if defined(__GNUC__)
    constexpr std::int32_t ahead = 24;         // vertices
    constexpr int line = 64, read = 3 * line;  // bytes: what is read lies in a node's first lines
    if (vertex + ahead >= record.first_vertex + record.vertex_count) return;
    const char* node =
        reinterpret_cast<const char*>(&record.body->m_nodes[node_of_vertex_[vertex + ahead]]);
    for (int at = 0; at < read; at += line) __builtin_prefetch(node + at);
#endif
  }
  /// The vertex of a node, or -1 if no face or edge uses the node.
  std::int32_t vertex_of(const BodyRecord& record, int node) const;
  /// Bullet's face that a face of topology() was read from.
  btSoftBody::Face& face(std::int32_t face) const {
    return bodies_[body_of(topology_.faces[face][0])].body->m_faces[face_of_face_[face]];
  }

 private:
  // What reveals a change of a body without reading its faces.
  struct Fingerprint {
    const btSoftBody* body;
    const btSoftBody::Node* nodes;
    std::uint64_t ignored;  // hash_of_ignored()
    int node_count, face_count, link_count, tetra_count;
    int group, mask, collisions;
    bool self, responds, excluded, marked_changed;
    btScalar margin;
    int proxy_id;  // tells new bodies from old ones at the same address
    bool operator==(const Fingerprint& s) const;
  };

  Fingerprint fingerprint(btSoftBody* body) const;
  // True if filters changed. An application may answer otherwise at any time.
  bool update_filters(const std::vector<Sleepers::Member>& members);
  // Adds to changed_ the members that are not as they were when they last took part.
  void find_changed(Span<const Fingerprint> members);
  void rebuild(const std::vector<Sleepers::Member>& members, WarningLog& warnings);
  void add_body(btSoftBody* body, int world_index, WarningLog& warnings);
  /// Reads the primitives of a body, or takes those of the last rebuild() if it is unchanged.
  const Primitives& primitives_of(const btSoftBody& body);
  void find_filters();

  CollisionFlags flags_;
  RefusedPairs refused_pairs_;
  bool valid_ = false;
  ScratchVector<Fingerprint> fingerprints_;                      // of the members
  std::vector<int> world_indices_;                               // of the members
  std::unordered_map<const btSoftBody*, Fingerprint> left_out_;  // when they last took part
  ExcludedBodies excluded_;
  bool filtered_by_application_ = false;  // in the last find_filters()
  std::set<const btSoftBody*> changed_;   // since forget_changes()
  // By body, with its own indices: what the last rebuild() read, and what this one has so far.
  std::unordered_map<const btSoftBody*, Primitives> primitives_, next_primitives_;

  std::vector<BodyRecord> bodies_;
  SceneTopology topology_;
  // By vertex: index of the node in its body; ascending in each body.
  std::vector<int> node_of_vertex_;
  // By face: index of the face in its body.
  std::vector<int> face_of_face_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
