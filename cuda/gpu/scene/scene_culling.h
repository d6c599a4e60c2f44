// Interface to culling beyond boxes and the non-penetration filter: of nodes in the traversal, and
// of candidates in the leaf kernel.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>

#include "gpu/scene/stages.h"
#include "host/bvh/groups.h"
#include "host/bvh/tree.h"
#include "host/scene/mesh.h"
#include "lazyccd/stats.h"

namespace lazyccd::gpu {

struct NodeCulling;  // of who implements the interface and the strategies that read it

/// The culling data of a scene, and the stages of a step that update it. Functions that take a
/// stream enqueue their work there and allocate nothing.
class SceneCulling {
 public:
  virtual ~SceneCulling() = default;

  /// Prepares for another mesh.
  virtual void set_mesh(const Mesh& mesh) = 0;
  /// Whether it needs the mesh's edges on the host.
  virtual bool needs_host_edges() const = 0;
  /// Whether it needs the tree of every build on the host, for set_tree().
  virtual bool needs_host_tree() const = 0;
  /// Allocates for trees of this size.
  virtual void reserve(std::size_t leaves, std::size_t nodes) = 0;
  /// Prepares for another tree, after reserve(). Only if needs_host_tree().
  virtual void set_tree(const Mesh& mesh, const Groups& groups, const Tree& tree) = 0;

  /// The stages of each step: clear_counters() comes first, enqueue_refit() after the boxes of
  /// groups.
  virtual void clear_counters(cudaStream_t stream) = 0;
  virtual void enqueue_refit(const SceneView& scene, cudaStream_t stream) = 0;
  /// What the traversal reads; null: it culls no nodes.
  virtual const NodeCulling* of_nodes() = 0;
  /// Enqueues the leaf kernel in place of gpu::enqueue_leaf(), and what belongs behind it. Returns
  /// false if gpu::enqueue_leaf() does.
  virtual bool enqueue_leaf(const SceneView& scene, const LeafPairs& pairs, bool vertex_face,
                            bool edge_edge, const StepLists& lists, cudaStream_t stream) = 0;
  /// Before the stages behind the traversal run again.
  virtual void clear_leaf_counters(cudaStream_t stream) = 0;

  /// Enqueues the download; add_to() is valid once the stream is synchronized.
  virtual void download(cudaStream_t stream) = 0;
  /// Writes what the step has culled.
  virtual void add_to(Stats& stats) const = 0;

  virtual std::size_t bytes() const = 0;
};

}  // namespace lazyccd::gpu
