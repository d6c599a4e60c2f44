// What the options ask for beyond boxes: volumes of nodes, normal cones, orphan sets, or no filter.
// Holds memory for what is asked for alone.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>

#include "core/normal_cone.h"
#include "core/oriented_box.h"
#include "cpu/bvh/groups.h"
#include "cpu/scene/mesh.h"
#include "cpu/bvh/tree.h"
#include "gpu/device/device_buffer.h"
#include "gpu/culling/leaf_culling.cuh"
#include "gpu/culling/node_culling.cuh"
#include "gpu/device/pinned_buffer.h"
#include "gpu/scene/scene.cuh"
#include "lazyccd/detector.h"

namespace lazyccd::gpu {

class SceneCulling {
 public:
  explicit SceneCulling(const DetectorOptions& options);

  // Whether the traversal is to ask it.
  bool culls_nodes() const { return volume_ != Volume::box || culling_.normal_cones; }
  // Whether candidates are to be filtered in another way than usual.
  bool culls_candidates() const { return !culling_.non_penetration || culling_.orphan_sets; }
  bool non_penetration() const { return culling_.non_penetration; }

  // For another mesh.
  void set_mesh(const Mesh& mesh);
  // For another tree.
  void build(const Mesh& mesh, const Groups& groups, const Tree& tree);

  // Of each step: first of all, behind the boxes of groups, and behind the leaf kernel.
  void clear_counters(cudaStream_t stream);
  void enqueue_refit(const SceneView& scene, cudaStream_t stream);
  void enqueue_orphans(const SceneView& scene, bool vertex_face, bool edge_edge,
                       const StepLists& lists, cudaStream_t stream);

  NodeCulling of_nodes();
  LeafCulling of_candidates() const;

  // Enqueues the download; counters() is valid once the stream is synchronized.
  void download(cudaStream_t stream);
  const CullingCounters& counters() const { return *host_counters_.data(); }

  std::size_t bytes() const;

 private:
  struct Orphans {
    DeviceBuffer<Candidate> pairs;
    DeviceBuffer<std::uint32_t> first;
    std::uint32_t count = 0;
  };

  void build_patches(const Mesh& mesh, const Groups& groups, const Tree& tree);
  bool any() const { return culls_nodes() || culls_candidates(); }
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
