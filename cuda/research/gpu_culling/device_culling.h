// Culling on the device beyond boxes and the non-penetration filter: volumes of nodes, normal
// cones, orphan sets. Allocates memory only for what the options ask for.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>

#include "gpu/device/device_buffer.h"
#include "gpu/device/pinned_buffer.h"
#include "gpu/scene/scene.cuh"
#include "gpu/scene/scene_culling.h"
#include "lazyccd/detector.h"
#include "research/culling/normal_cone.h"
#include "research/gpu_culling/node_culling.cuh"
#include "research/gpu_culling/orphans.cuh"
#include "research/volumes/oriented_box.h"

namespace lazyccd::gpu::research {

class DeviceCulling : public SceneCulling {
 public:
  explicit DeviceCulling(const DetectorOptions& options);

  void set_mesh(const Mesh& mesh) override;
  bool needs_host_edges() const override { return culling_.orphan_sets; }
  bool needs_host_tree() const override { return culling_.normal_cones; }
  void reserve(std::size_t leaves, std::size_t nodes) override;
  void set_tree(const Mesh& mesh, const Groups& groups, const Tree& tree) override;

  void clear_counters(cudaStream_t stream) override;
  void enqueue_refit(const SceneView& scene, cudaStream_t stream) override;
  const NodeCulling* of_nodes() override;
  bool enqueue_leaf(const SceneView& scene, const LeafPairs& pairs, bool vertex_face,
                    bool edge_edge, const StepLists& lists, cudaStream_t stream) override;
  void clear_leaf_counters(cudaStream_t stream) override;

  void download(cudaStream_t stream) override;
  void add_to(Stats& stats) const override;

  std::size_t bytes() const override;

 private:
  struct Orphans {
    DeviceBuffer<Candidate> pairs;
    DeviceBuffer<std::uint32_t> first;
    std::uint32_t count = 0;
  };

  OrphanFilter filter() const;
  template <class Record>
  void enqueue_refit_as(const SceneView& scene, cudaStream_t stream);
  template <class Record>
  void enqueue_boxes(const SceneView& scene, cudaStream_t stream);
  void enqueue_diagonals(const SceneView& scene, cudaStream_t stream);
  template <class Record>
  void enqueue_cones(const SceneView& scene, cudaStream_t stream);

  Volume volume_;
  Culling culling_;
  NodeCulling of_nodes_{};  // of the last of_nodes()
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

}  // namespace lazyccd::gpu::research
