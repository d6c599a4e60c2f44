// Allocation, sorts and launches of the build.
#include "gpu/bvh/hierarchy_builder.h"

#include <algorithm>
#include <cfloat>
#include <cub/device/device_merge_sort.cuh>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>

#include "gpu/bvh/cell_codes.cuh"
#include "gpu/bvh/ownership.cuh"
#include "gpu/bvh/radix_tree.cuh"

namespace lazyccd::gpu {
namespace {

constexpr std::uint32_t kBlock = 128;
constexpr int kCodeBits = 63;

struct Less {
  __device__ bool operator()(std::uint64_t a, std::uint64_t b) const { return a < b; }
};

// Up to this many leaves, the passes of a merge sort take less time than those of a radix sort.
constexpr std::int32_t kFewLeaves = 1 << 16;

}  // namespace

void HierarchyBuilder::lay_out(Carver carver) {
  const auto cells = static_cast<std::size_t>(view_.cell_count);
  const auto groups = static_cast<std::size_t>(view_.group_count);
  for (int i = 0; i < 2; ++i) {
    codes_[i] = carver.take<std::uint64_t>(cells);
    cells_[i] = carver.take<std::int32_t>(cells);
    segment_keys_[i] = carver.take<std::uint32_t>(view_.segment_count > 1 ? cells : 0);
    leaf_codes_[i] = carver.take<std::uint64_t>(groups);
    leaf_groups_[i] = carver.take<std::int32_t>(groups);
  }
  view_.bounds = carver.take<long long>(6);
  view_.order = carver.take<std::int32_t>(cells);
  view_.first_of_vertex = carver.take<std::uint32_t>(static_cast<std::size_t>(view_.vertex_count));
  view_.first_of_edge = carver.take<std::uint32_t>(edge_count_);
  view_.owned = carver.take<OwnedContents>(cells);
  view_.place_counts = carver.take<std::int32_t>(groups);
  view_.first_places = carver.take<std::int32_t>(groups);
  view_.inner = carver.take<InnerNode>(groups);
  view_.links = carver.take<ParentLink>(groups);
  space_ = carver.take<char>(space_size_);
  used_ = carver.used();
}

void HierarchyBuilder::set_mesh(const Mesh& mesh, DeviceScene& scene) {
  const Cells& cells = mesh.cells();
  const DeviceMesh& arrays = scene.mesh();
  const SceneView view = scene.view(false);
  edge_count_ = mesh.edge_count();
  world_count_ = static_cast<std::size_t>(mesh.world_count());
  view_ = {};
  view_.contents = {view.mesh.faces,
                    reinterpret_cast<const std::int32_t(*)[3]>(arrays.face_edges.data()),
                    view.mesh.edges};
  view_.primitives = arrays.has_primitives ? arrays.primitives.data() : nullptr;
  view_.segments = arrays.segments.data();
  view_.vertex_count = static_cast<std::int32_t>(mesh.vertex_count());
  view_.cell_count =
      cells.segments().empty() ? 0 : cells.segments().back().first + cells.segments().back().count;
  view_.segment_count = static_cast<std::int32_t>(cells.segments().size());
  view_.group_count = static_cast<std::int32_t>(cells.group_count());
  view_.pinned = view.pinned;
  view_.bodies = view.groups.bodies;
  view_.worlds = mesh.world_of_body().empty() ? nullptr : arrays.worlds.data();
  const HierarchyArrays hierarchy = scene.arrays();
  view_.groups = hierarchy.groups;
  view_.names = hierarchy.names;
  view_.leaf_order = hierarchy.leaf_order;
  view_.node_ranges = hierarchy.node_ranges;
  view_.nodes = hierarchy.nodes;
  space_size_ = std::max<std::size_t>(space_bytes(), 1);
  lay_out(Carver(nullptr));
  lay_out(Carver(scene.workspace(used_)));
  // The uploads go through another stream than the build, which does not wait for it.
  LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(cudaStreamLegacy));
}

int HierarchyBuilder::segment_bits() const {
  int bits = 0;
  while (view_.segment_count - 1 >> bits != 0) ++bits;
  return bits;
}

std::size_t HierarchyBuilder::space_bytes() const {
  std::size_t most = 0, bytes = 0;
  const auto note = [&](cudaError_t result) {
    LAZYCCD_CUDA_CHECK(result);
    most = std::max(most, bytes);
  };
  cub::DoubleBuffer<std::uint64_t> keys;
  cub::DoubleBuffer<std::uint32_t> segments;
  cub::DoubleBuffer<std::int32_t> values;
  std::int32_t* counts = nullptr;
  note(cub::DeviceRadixSort::SortPairs(nullptr, bytes, keys, values, view_.cell_count, 0,
                                       kCodeBits));
  note(cub::DeviceRadixSort::SortPairs(nullptr, bytes, segments, values, view_.cell_count, 0,
                                       std::max(segment_bits(), 1)));
  note(cub::DeviceRadixSort::SortPairs(nullptr, bytes, segments, values, view_.group_count, 0,
                                       std::max(world_bits(), 1)));
  note(cub::DeviceScan::ExclusiveSum(nullptr, bytes, counts, counts, view_.group_count));
  note(cub::DeviceRadixSort::SortPairs(nullptr, bytes, keys, values, view_.group_count, 0,
                                       kCodeBits));
  note(cub::DeviceMergeSort::StableSortPairs(nullptr, bytes, keys.Current(), values.Current(),
                                             view_.group_count, Less{}));
  return most;
}

template <class Scalar>
const std::int32_t* HierarchyBuilder::sort_cells(const Scalar* start, cudaStream_t stream) {
  const std::uint32_t vertices = static_cast<std::uint32_t>(view_.vertex_count);
  const std::uint32_t blocks = blocks_for(static_cast<std::size_t>(view_.cell_count), kBlock);
  clear_bounds<<<1, kWarp, 0, stream>>>(view_);
  constexpr std::uint32_t reducing = 256;
  find_bounds<<<std::min(blocks_for(vertices, 4 * reducing), 4 * multiprocessors()), reducing, 0,
                stream>>>(view_, start);
  find_cell_codes<<<blocks, kBlock, 0, stream>>>(view_, start, codes_[0], cells_[0]);
  LAZYCCD_CUDA_CHECK(cudaGetLastError());
  cub::DoubleBuffer<std::uint64_t> codes(codes_[0], codes_[1]);
  cub::DoubleBuffer<std::int32_t> cells(cells_[0], cells_[1]);
  std::size_t size = space_size_;
  LAZYCCD_CUDA_CHECK(cub::DeviceRadixSort::SortPairs(space_, size, codes, cells, view_.cell_count,
                                                     0, kCodeBits, stream));
  if (view_.segment_count == 1) return cells.Current();
  // Stable: within a segment the order by code stays.
  find_segments<<<blocks, kBlock, 0, stream>>>(view_, cells.Current(), segment_keys_[0]);
  LAZYCCD_CUDA_CHECK(cudaGetLastError());
  cub::DoubleBuffer<std::uint32_t> segments(segment_keys_[0], segment_keys_[1]);
  size = space_size_;
  LAZYCCD_CUDA_CHECK(cub::DeviceRadixSort::SortPairs(space_, size, segments, cells,
                                                     view_.cell_count, 0, segment_bits(), stream));
  return cells.Current();
}

void HierarchyBuilder::sort_leaves(cudaStream_t stream) {
  sort_leaves_by_code(stream);
  if (view_.worlds == nullptr) return;
  // Stable: within a world the order by code stays. The arrays of the cells are free by now.
  const std::uint32_t blocks = blocks_for(static_cast<std::size_t>(view_.group_count), kBlock);
  find_leaf_worlds<<<blocks, kBlock, 0, stream>>>(view_, segment_keys_[0], cells_[0]);
  LAZYCCD_CUDA_CHECK(cudaGetLastError());
  cub::DoubleBuffer<std::uint32_t> worlds(segment_keys_[0], segment_keys_[1]);
  cub::DoubleBuffer<std::int32_t> places(cells_[0], cells_[1]);
  std::size_t size = space_size_;
  LAZYCCD_CUDA_CHECK(cub::DeviceRadixSort::SortPairs(space_, size, worlds, places,
                                                     view_.group_count, 0, world_bits(), stream));
  const int other = view_.leaf_codes == leaf_codes_[0] ? 1 : 0;
  move_leaves<<<blocks, kBlock, 0, stream>>>(view_, places.Current(), leaf_codes_[other],
                                             leaf_groups_[other]);
  LAZYCCD_CUDA_CHECK(cudaGetLastError());
  view_.leaf_codes = leaf_codes_[other];
  view_.leaf_groups = leaf_groups_[other];
}

void HierarchyBuilder::sort_leaves_by_code(cudaStream_t stream) {
  std::size_t size = space_size_;
  if (view_.group_count <= kFewLeaves) {
    LAZYCCD_CUDA_CHECK(cub::DeviceMergeSort::StableSortPairs(
        space_, size, view_.leaf_codes, view_.leaf_groups, view_.group_count, Less{}, stream));
    return;
  }
  cub::DoubleBuffer<std::uint64_t> codes(leaf_codes_[0], leaf_codes_[1]);
  cub::DoubleBuffer<std::int32_t> groups(leaf_groups_[0], leaf_groups_[1]);
  LAZYCCD_CUDA_CHECK(cub::DeviceRadixSort::SortPairs(space_, size, codes, groups, view_.group_count,
                                                     0, kCodeBits, stream));
  view_.leaf_codes = codes.Current();
  view_.leaf_groups = groups.Current();
}

template <class Scalar>
void HierarchyBuilder::enqueue_as(const Scalar* start, cudaStream_t stream) {
  const std::size_t cell_count = static_cast<std::size_t>(view_.cell_count);
  const std::size_t group_count = static_cast<std::size_t>(view_.group_count);
  const std::size_t vertex_count = static_cast<std::size_t>(view_.vertex_count);
  const std::int32_t* const cells = sort_cells(start, stream);
  LAZYCCD_CUDA_CHECK(
      cudaMemsetAsync(view_.first_of_vertex, 0xff, vertex_count * sizeof(std::uint32_t), stream));
  LAZYCCD_CUDA_CHECK(
      cudaMemsetAsync(view_.first_of_edge, 0xff, edge_count_ * sizeof(std::uint32_t), stream));
  claim_contents<<<blocks_for(cell_count, kBlock), kBlock, 0, stream>>>(view_, cells);
  view_.leaf_codes = leaf_codes_[0];
  view_.leaf_groups = leaf_groups_[0];
  const std::uint32_t blocks = blocks_for(group_count * kGroupCells, kBlock);
  count_contents<<<blocks, kBlock, 0, stream>>>(view_, start);
  LAZYCCD_CUDA_CHECK(cudaGetLastError());
  std::size_t size = space_size_;
  LAZYCCD_CUDA_CHECK(cub::DeviceScan::ExclusiveSum(space_, size, view_.place_counts,
                                                   view_.first_places, view_.group_count, stream));
  name_contents<<<blocks, kBlock, 0, stream>>>(view_);
  LAZYCCD_CUDA_CHECK(cudaGetLastError());
  sort_leaves(stream);
  find_inner_nodes<<<blocks_for(group_count, kBlock), kBlock, 0, stream>>>(view_);
  write_nodes<<<blocks_for(group_count, kBlock), kBlock, 0, stream>>>(view_);
  LAZYCCD_CUDA_CHECK(cudaGetLastError());
}

void HierarchyBuilder::enqueue(const void* start, bool is_double, cudaStream_t stream) {
  if (view_.group_count == 0) return;
  if (is_double) {
    enqueue_as(static_cast<const double*>(start), stream);
  } else {
    enqueue_as(static_cast<const float*>(start), stream);
  }
}

}  // namespace lazyccd::gpu
