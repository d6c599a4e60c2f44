// Culling that the options request beyond boxes: volumes of nodes, normal cones, orphan sets, or no
// filter. Allocates memory only for what is requested.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>

#include "core/bvh/normal_cone.h"
#include "core/bvh/oriented_box.h"
#include "gpu/bvh/node_culling.cuh"
#include "gpu/device/device_buffer.h"
#include "gpu/device/pinned_buffer.h"
#include "gpu/scene/leaf_culling.cuh"
#include "gpu/scene/scene.cuh"
#include "host/bvh/groups.h"
#include "host/bvh/tree.h"
#include "host/scene/mesh.h"
#include "lazyccd/detector.h"

namespace lazyccd::gpu {

/// The culling data of a scene, and the stages of a step that update it.
class SceneCulling {
 public:
  explicit SceneCulling(const DetectorOptions& options);

  /// Whether the traversal must cull nodes.
  bool culls_nodes() const { return volume_ != Volume::box || culling_.normal_cones; }
  /// Whether candidates are filtered in another way than by default.
  bool culls_candidates() const { return !culling_.non_penetration || culling_.orphan_sets; }
  bool non_penetration() const { return culling_.non_penetration; }

  /// Prepares for another mesh.
  void set_mesh(const Mesh& mesh);
  /// Whether the culling needs the tree of every build on the host, for set_tree().
  bool needs_host_tree() const { return culling_.normal_cones; }
  /// Allocates for trees of this size.
  void reserve(std::size_t leaves, std::size_t nodes);
  /// Prepares for another tree, after reserve(). Only if needs_host_tree().
  void set_tree(const Mesh& mesh, const Groups& groups, const Tree& tree);

  /// The stages of each step: clear_counters() comes first, enqueue_refit() after the boxes of
  /// groups, and enqueue_orphans() after the leaf kernel.
  void clear_counters(cudaStream_t stream);
  /// Before the stages behind the traversal run again.
  void clear_orphan_count(cudaStream_t stream);
  void enqueue_refit(const SceneView& scene, cudaStream_t stream);
  void enqueue_orphans(const SceneView& scene, bool vertex_face, bool edge_edge,
                       const StepLists& lists, cudaStream_t stream);

  NodeCulling of_nodes();
  LeafCulling of_candidates() const;

  /// Enqueues the download; counters() is valid once the stream is synchronized.
  void download(cudaStream_t stream);
  const CullingCounters& counters() const { return *host_counters_.data(); }

  std::size_t bytes() const;

 private:
  struct Orphans {
    DeviceBuffer<Candidate> pairs;
    DeviceBuffer<std::uint32_t> first;
    std::uint32_t count = 0;
  };

  bool is_enabled() const { return culls_nodes() || culls_candidates(); }
  template <class Record>
  void enqueue_refit_as(const SceneView& scene, cudaStream_t stream);
  template <class Record>
  void enqueue_boxes(const SceneView& scene, cudaStream_t stream);
  void enqueue_diagonals(const SceneView& scene, cudaStream_t stream);
  template <class Record>
  void enqueue_cones(const SceneView& scene, cudaStream_t stream);

  Volume volume_;
  Culling culling_;
  DeviceBuffer<CullingCounters> counters_;
  PinnedBuffer<CullingCounters> host_counters_;

  DeviceBuffer<OrientedBox> boxes_;  // of leaves, runs and nodes
  DeviceBuffer<OrientedBoxOf<float>> node_boxes_;
  DeviceBuffer<Moments> moments_;
  std::uint32_t first_run_ = 0, first_node_ = 0;
  DeviceBuffer<NodeDiagonals> run_diagonals_, node_diagonals_;
  DeviceBuffer<NodePatch> patches_;
  DeviceBuffer<std::int32_t> boundary_vertices_;
  std::uint32_t patch_count_ = 0;
  DeviceBuffer<Directions> leaf_cones_;
  DeviceBuffer<unsigned char> flat_;
  Orphans orphans_[2];  // by ContactKind
};

}  // namespace lazyccd::gpu
