// The mesh, its groups and their hierarchy in device memory.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gpu/device/device_buffer.h"
#include "gpu/device/pinned_buffer.h"
#include "gpu/scene/device_mesh.h"
#include "gpu/scene/scene.cuh"
#include "host/bvh/groups.h"
#include "host/bvh/tree.h"
#include "host/scene/mesh.h"
#include "host/threads/thread_pool.h"

namespace lazyccd::gpu {

/// The arrays that a build of the hierarchy fills, on the device.
struct HierarchyArrays {
  DeviceGroup* groups;
  PrimitiveNames* names;
  std::int32_t* leaf_order;
  int2* node_ranges;
  TreeNode* nodes;  // all but the boxes
};

class DeviceScene {
 public:
  /// reduces: DetectorOptions::reduce_contacts.
  DeviceScene(double separation, bool reduces) : separation_(separation), reduces_(reduces) {}

  /// Sets another mesh. It must stay valid until the next call. `is_found`: mesh() has its
  /// primitives already. Otherwise it must be complete.
  void set_mesh(const Mesh& mesh, bool is_found = false);
  DeviceMesh& mesh() { return arrays_; }

  /// Memory for work before a step: that of the boxes, which every step computes anew. It is lost
  /// with prepare() and with the step.
  char* workspace(std::size_t bytes);
  /// Uploads the mesh if that is not done, and allocates the arrays for any build of its hierarchy.
  void prepare();
  /// Where a build on the device puts groups and tree (gpu/bvh/hierarchy_builder.h). They last for
  /// many steps; each step refits their boxes.
  HierarchyArrays arrays();

  /// Builds groups and tree on the host instead, and uploads them. Needs no prepare().
  void build_on_host(const Positions& start, const Positions& end, ThreadPool& pool);
  const Groups& groups() const { return groups_; }  ///< of the last build on the host
  const Tree& tree() const { return tree_; }        ///< the same
  /// Enqueues the upload of the mesh's resting bodies, if there are others than before. Needs
  /// prepare() or build_on_host() before.
  void update_resting(cudaStream_t stream);
  /// Enqueues what clears NearView::min_distance, and its download.
  void clear_near_distances(cudaStream_t stream);
  void download_near_distances(cudaStream_t stream);
  /// By body, once the download is done; a large number where nothing was near.
  Span<const double> near_distances() const;
  /// Makes room for the records of a step. Returns whether their address has changed. Must come
  /// before view().
  bool reserve_records(bool is_double);
  SceneView view(bool is_double);
  ContactKey key() const;  ///< for the host
  std::uint32_t group_count() const {
    return static_cast<std::uint32_t>(mesh_->cells().group_count());
  }
  std::uint32_t node_count() const { return group_count() == 0 ? 0 : 2 * group_count() - 1; }
  std::size_t bytes() const;

 private:
  void upload_mesh();
  NearView near_view();
  void upload_groups();
  void reserve_boxes(std::size_t bytes);
  void reserve_places(std::size_t places);  // boxes and names

  double separation_;
  bool reduces_;
  const Mesh* mesh_ = nullptr;
  bool is_found_ = false, mesh_uploaded_ = false;
  Groups groups_;
  Tree tree_;

  DeviceMesh arrays_;
  DeviceBuffer<DeviceGroup> device_groups_;
  DeviceBuffer<std::int32_t> leaf_order_;
  DeviceBuffer<int2> node_ranges_;
  DeviceBuffer<PrimitiveNames> names_;
  BoxArrays box_arrays();

  // Only with a separation, by body.
  DeviceBuffer<char> resting_;
  std::vector<char> uploaded_resting_;
  DeviceBuffer<double> near_distances_;
  PinnedBuffer<double> host_near_distances_;

  // Recomputed in each step.
  struct alignas(16) RecordPiece {
    char bytes[16];
  };
  DeviceBuffer<RecordPiece> records_;  // of either precision
  DeviceBuffer<RecordPiece> boxes_;
  std::size_t places_ = 0;  // places that the boxes have room for
  DeviceBuffer<GroupBounds> bounds_;
  DeviceBuffer<SweptBox> runs_;
  DeviceBuffer<TreeNode> nodes_;
};

}  // namespace lazyccd::gpu
