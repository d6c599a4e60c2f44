// A checked copy of the caller's topology, with all edges.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <unordered_set>
#include <utility>
#include <vector>

#include "core/narrow/contact_key.h"
#include "core/narrow/contact_math.h"
#include "core/narrow/contact_reduction.h"
#include "host/scene/cells.h"
#include "host/scene/edge_table.h"
#include "host/scene/kept_edges.h"
#include "host/scene/topology_finder.h"
#include "host/threads/noinit_vector.h"
#include "host/threads/thread_pool.h"
#include "lazyccd/export.h"
#include "lazyccd/scene.h"

namespace lazyccd {

/// Arrays of a mesh that is no longer used, for the next one: to get pages from the system takes
/// longer than to fill them. Much more memory than the next mesh needs is freed.
struct MeshMemory {
  NoinitVector<Face> faces;
  NoinitVector<std::int32_t> body_of_vertex;
};

/// The primitives of all bodies and the collision filters.
class Mesh {
 public:
  Mesh() = default;
  /// Checks and copies the topology. If it is invalid, throws Error with the body and the vertex,
  /// edge or face at fault. `finder`: finds the edges; the mesh is not complete then. Null: the
  /// host does. `last`: an earlier mesh, from which the host takes the edges of bodies that are in
  /// both; null: none. `memory`: its contents are lost.
  Mesh(const Topology& topology, ThreadPool& pool, TopologyFinder* finder = nullptr,
       const Mesh* last = nullptr, MeshMemory memory = {});
  explicit Mesh(const Topology& topology);  ///< on the calling thread alone
  /// Gives its memory away. The mesh must not be used after that.
  MeshMemory release_memory() { return {std::move(faces_), std::move(body_of_vertex_)}; }

  /// Whether the host has edges and cells. If not, only their numbers and the segments are known.
  bool is_complete() const { return is_complete_; }
  /// Finds edges and cells on the host, if that is not done. It changes nothing that a mesh without
  /// them shows. One thread at a time may call it.
  void complete(ThreadPool& pool) const { complete(pool, nullptr); }

  std::size_t vertex_count() const { return body_of_vertex_.size(); }
  Span<const Face> faces() const { return view_of(faces_); }
  std::size_t edge_count() const { return edge_count_; }
  /// All edges, each as (smaller, larger) vertex index; sorted by the larger index, then the
  /// smaller. This and all that follows from edges needs a complete mesh.
  Span<const Edge> edges() const { return view_of(edges_.edges); }
  /// Indices into edges() of the edges that are no side of a face.
  Span<const std::int32_t> free_edges() const { return view_of(edges_.free_edges); }
  /// By face: indices into edges() of its sides (0 1), (1 2), (2 0).
  Span<const std::array<std::int32_t, 3>> face_edges() const { return view_of(edges_.face_edges); }
  Span<const std::int32_t> body_of_vertex() const { return view_of(body_of_vertex_); }
  /// All faces and free edges, by body.
  const Cells& cells() const { return cells_; }
  std::size_t body_count() const { return bodies_.size(); }
  /// By body: its world, as Body::world. Empty if all bodies are in the same world.
  Span<const std::int32_t> world_of_body() const { return world_of_body_; }
  /// Number of worlds, not counting -1. Some may have no body.
  std::int32_t world_count() const { return world_count_; }
  bool pinned(std::int32_t vertex) const { return !pinned_.empty() && pinned_[vertex]; }
  bool any_pinned() const { return !pinned_.empty(); }
  Span<const char> pinned_vertices() const { return pinned_; }  ///< by vertex; empty: none is
  /// Sets what Detector::leave_out() names. An empty array leaves out nothing.
  void leave_out(Span<const char> edges, Span<const char> vertices);
  bool leaves_out_edge(std::int32_t edge) const {
    return !edges_left_out_.empty() && edges_left_out_[edge];
  }
  bool leaves_out_vertex(std::int32_t vertex) const {
    return !vertices_left_out_.empty() && vertices_left_out_[vertex];
  }
  bool leaves_out_any() const { return !edges_left_out_.empty() || !vertices_left_out_.empty(); }
  Span<const char> edges_left_out() const { return edges_left_out_; }        ///< or empty
  Span<const char> vertices_left_out() const { return vertices_left_out_; }  ///< or empty
  /// Sets what Detector::set_resting() names: as many elements as bodies, or none.
  void set_resting(Span<const char> bodies) { resting_.assign(bodies.begin(), bodies.end()); }
  bool has_resting(Span<const char> bodies) const {
    return std::equal(bodies.begin(), bodies.end(), resting_.begin(), resting_.end());
  }
  Span<const char> resting() const { return resting_; }  ///< by body; empty: none rests
  bool any_resting() const { return !resting_.empty(); }
  bool rests(std::int32_t body) const { return any_resting() && resting_[body]; }
  /// By vertex, as Topology::self_separation; null: no limit.
  const float* self_separation() const {
    return self_separation_.empty() ? nullptr : self_separation_.data();
  }
  /// The smallest of a body's self_separation(); infinite without a limit, or if it does not
  /// collide with itself.
  float least_self_separation(std::size_t body) const {
    return least_self_separation_.empty() ? std::numeric_limits<float>::infinity()
                                          : least_self_separation_[body];
  }

  const std::vector<Body>& bodies() const { return bodies_; }
  /// The disabled pairs of bodies, as smaller index << 32 | larger index, unordered.
  const std::unordered_set<std::uint64_t>& disabled_pairs() const { return disabled_; }
  LAZYCCD_API MeshView view() const;
  CellView cell_view() const;
  FirstFaces first_faces() const;
  ContactKey contact_key() const;
  ContactOrder contact_order() const;

  /// Whether the filters let two bodies of one world collide. With body_a == body_b: with itself.
  LAZYCCD_API bool collide(std::int32_t body_a, std::int32_t body_b) const;

 private:
  template <class T>
  static Span<const T> view_of(const NoinitVector<T>& v) {
    return {v.data(), v.size()};
  }

  void complete(ThreadPool& pool, const Mesh* last) const;
  bool take_edges_of(const Mesh* last, ThreadPool& pool) const;
  EdgeInput edge_input() const;
  void take_bodies(const Topology& topology, ThreadPool& pool);
  void take_self_separation(Span<const float> of_vertex);
  void take_worlds();
  // checks: whether the indices must be checked.
  void take_faces(const Topology& topology, ThreadPool& pool, bool checks);
  void take_edges(const Topology& topology, TopologyFinder& finder);
  // Throws the error of the first face or edge that is invalid, if there is one.
  void check_primitives(const Topology& topology) const;
  void find_first_faces(ThreadPool& pool) const;
  void check_primitives_of_bodies() const;

  NoinitVector<Face> faces_;
  mutable std::size_t edge_count_ = 0;
  // What complete() finds, and from what.
  mutable bool is_complete_ = true;
  std::vector<Edge> more_edges_;  // Topology::edges; kept for the next mesh
  mutable EdgeTable edges_;
  mutable Cells cells_;
  mutable NoinitVector<std::int32_t> first_faces_;  // by edge, then by vertex: see FirstFaces
  NoinitVector<std::int32_t> body_of_vertex_;
  std::vector<Body> bodies_;
  std::vector<std::int32_t> world_of_body_;
  std::int32_t world_count_ = 0;
  std::vector<char> pinned_;                  // by vertex; empty if no vertex is pinned
  std::vector<float> self_separation_;        // by vertex, or empty
  std::vector<float> least_self_separation_;  // by body, or empty
  std::vector<char> edges_left_out_, vertices_left_out_;
  std::vector<char> resting_;  // by body; empty if none rests
  std::unordered_set<std::uint64_t> disabled_;
};

}  // namespace lazyccd
