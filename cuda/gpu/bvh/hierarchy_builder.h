// Building of the hierarchy on the device: the groups and the tree that Groups and Tree build on
// the host, to the bit, from the positions and the mesh in device memory.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>

#include "gpu/bvh/build_view.cuh"
#include "gpu/device/carver.h"
#include "gpu/scene/device_scene.h"
#include "host/scene/mesh.h"

namespace lazyccd::gpu {

/// Works in the scene's workspace. Per cell it takes about 50 bytes.
class HierarchyBuilder {
 public:
  /// Prepares for a mesh and the scene on the device that holds it, after DeviceScene::prepare().
  /// The mesh is not used afterwards.
  void set_mesh(const Mesh& mesh, DeviceScene& scene);

  /// Enqueues the build, from three scalars per vertex at the start of the step. It allocates
  /// nothing, does not wait, and enqueues the same launches for the same arguments. The boxes are
  /// left to the refit.
  void enqueue(const void* start, bool is_double, cudaStream_t stream);

 private:
  // Places the arrays of the work space.
  void lay_out(Carver carver);
  template <class Scalar>
  void enqueue_as(const Scalar* start, cudaStream_t stream);
  // Sorts the cells by segment and code; returns the sorted cells.
  template <class Scalar>
  const std::int32_t* sort_cells(const Scalar* start, cudaStream_t stream);
  // Sorts the leaves by world and code and sets view_ to where they are then.
  void sort_leaves(cudaStream_t stream);
  void sort_leaves_by_code(cudaStream_t stream);
  // Returns the largest size of CUB's work space, in bytes.
  std::size_t space_bytes() const;
  // Number of bits of the largest segment, and of the largest world.
  int segment_bits() const;
  int world_bits() const { return bits_for(world_count_ + 1); }

  BuildView view_{};
  std::size_t edge_count_ = 0, world_count_ = 0;
  // Arrays of two are for sorts, from one to the other.
  std::uint64_t* codes_[2];
  std::int32_t* cells_[2];
  std::uint32_t* segment_keys_[2];
  std::uint64_t* leaf_codes_[2];
  std::int32_t* leaf_groups_[2];
  char* space_ = nullptr;                  // of CUB
  std::size_t space_size_ = 0, used_ = 0;  // bytes; used_: of all arrays
};

}  // namespace lazyccd::gpu
