// Allocation, sorts and launches of the build.
#include "gpu/bvh/hierarchy_builder.h"

#include <algorithm>
#include <cfloat>
#include <cub/device/device_merge_sort.cuh>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>
#include <vector>

#include "gpu/bvh/cell_codes.cuh"
#include "gpu/bvh/ownership.cuh"
#include "gpu/bvh/radix_tree.cuh"
#include "gpu/device/upload.h"

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

void HierarchyBuilder::set_mesh(const Mesh& mesh, DeviceScene& scene) {
  static_assert(sizeof(Face) == 3 * sizeof(std::int32_t));
  const Cells& cells = mesh.cells();
  const std::size_t cell_count = cells.primitives().size(), groups = cells.group_count();
  upload(face_edges_, mesh.face_edges().data(), 3 * mesh.face_edges().size());
  upload(primitives_, cells.primitives().data(), cell_count);
  upload(segments_, cells.segments().data(), cells.segments().size());
  std::vector<std::int32_t> worlds;  // by group
  if (!mesh.world_of_body().empty())
    for (const CellSegment& segment : cells.segments())
      worlds.insert(worlds.end(), static_cast<std::size_t>(segment.groups()),
                    mesh.world_of_body()[static_cast<std::size_t>(segment.body)]);
  upload(worlds_, worlds.data(), worlds.size());
  world_count_ = static_cast<std::size_t>(mesh.world_count());
  const auto reserve = [](auto& buffer, std::size_t size) {
    buffer.reserve(std::max<std::size_t>(size, 1));
  };
  reserve(bounds_, 6);
  for (int i = 0; i < 2; ++i) {
    reserve(codes_[i], cell_count);
    reserve(cells_[i], cell_count);
    if (cells.segments().size() > 1) reserve(segment_keys_[i], cell_count);
    reserve(leaf_codes_[i], groups);
    reserve(leaf_groups_[i], groups);
  }
  reserve(order_, cell_count);
  reserve(first_of_vertex_, mesh.vertex_count());
  reserve(first_of_edge_, mesh.edges().size());
  reserve(owned_, cell_count);
  reserve(block_counts_, groups);
  reserve(first_blocks_, groups);
  reserve(inner_, groups);
  reserve(links_, groups);
  edge_count_ = mesh.edges().size();

  const SceneView view = scene.view(false);
  view_ = {};
  view_.contents = {view.mesh.faces, reinterpret_cast<const std::int32_t(*)[3]>(face_edges_.data()),
                    view.mesh.edges};
  view_.primitives = primitives_.data();
  view_.segments = segments_.data();
  view_.vertex_count = static_cast<std::int32_t>(mesh.vertex_count());
  view_.cell_count = static_cast<std::int32_t>(cell_count);
  view_.segment_count = static_cast<std::int32_t>(cells.segments().size());
  view_.group_count = static_cast<std::int32_t>(groups);
  view_.pinned = view.pinned;
  view_.bodies = view.groups.bodies;
  view_.worlds = worlds.empty() ? nullptr : worlds_.data();
  view_.bounds = bounds_.data();
  view_.order = order_.data();
  view_.first_of_vertex = first_of_vertex_.data();
  view_.first_of_edge = first_of_edge_.data();
  view_.owned = owned_.data();
  view_.block_counts = block_counts_.data();
  view_.first_blocks = first_blocks_.data();
  view_.inner = inner_.data();
  view_.links = links_.data();
  const HierarchyArrays arrays = scene.arrays();
  view_.groups = arrays.groups;
  view_.blocks = arrays.blocks;
  view_.leaf_order = arrays.leaf_order;
  view_.node_ranges = arrays.node_ranges;
  view_.nodes = arrays.nodes;
  space_size_ = std::max<std::size_t>(space_bytes(), 1);
  space_.reserve(space_size_);
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
  find_cell_codes<<<blocks, kBlock, 0, stream>>>(view_, start, codes_[0].data(), cells_[0].data());
  LAZYCCD_CUDA_CHECK(cudaGetLastError());
  cub::DoubleBuffer<std::uint64_t> codes(codes_[0].data(), codes_[1].data());
  cub::DoubleBuffer<std::int32_t> cells(cells_[0].data(), cells_[1].data());
  std::size_t size = space_size_;
  LAZYCCD_CUDA_CHECK(cub::DeviceRadixSort::SortPairs(space_.data(), size, codes, cells,
                                                     view_.cell_count, 0, kCodeBits, stream));
  if (view_.segment_count == 1) return cells.Current();
  // Stable: within a segment the order by code stays.
  find_segments<<<blocks, kBlock, 0, stream>>>(view_, cells.Current(), segment_keys_[0].data());
  LAZYCCD_CUDA_CHECK(cudaGetLastError());
  cub::DoubleBuffer<std::uint32_t> segments(segment_keys_[0].data(), segment_keys_[1].data());
  size = space_size_;
  LAZYCCD_CUDA_CHECK(cub::DeviceRadixSort::SortPairs(space_.data(), size, segments, cells,
                                                     view_.cell_count, 0, segment_bits(), stream));
  return cells.Current();
}

void HierarchyBuilder::sort_leaves(cudaStream_t stream) {
  sort_leaves_by_code(stream);
  if (view_.worlds == nullptr) return;
  // Stable: within a world the order by code stays. The arrays of the cells are free by now.
  const std::uint32_t blocks = blocks_for(static_cast<std::size_t>(view_.group_count), kBlock);
  find_leaf_worlds<<<blocks, kBlock, 0, stream>>>(view_, segment_keys_[0].data(), cells_[0].data());
  LAZYCCD_CUDA_CHECK(cudaGetLastError());
  cub::DoubleBuffer<std::uint32_t> worlds(segment_keys_[0].data(), segment_keys_[1].data());
  cub::DoubleBuffer<std::int32_t> places(cells_[0].data(), cells_[1].data());
  std::size_t size = space_size_;
  LAZYCCD_CUDA_CHECK(cub::DeviceRadixSort::SortPairs(space_.data(), size, worlds, places,
                                                     view_.group_count, 0, world_bits(), stream));
  const int other = view_.leaf_codes == leaf_codes_[0].data() ? 1 : 0;
  move_leaves<<<blocks, kBlock, 0, stream>>>(view_, places.Current(), leaf_codes_[other].data(),
                                             leaf_groups_[other].data());
  LAZYCCD_CUDA_CHECK(cudaGetLastError());
  view_.leaf_codes = leaf_codes_[other].data();
  view_.leaf_groups = leaf_groups_[other].data();
}

void HierarchyBuilder::sort_leaves_by_code(cudaStream_t stream) {
  std::size_t size = space_size_;
  if (view_.group_count <= kFewLeaves) {
    LAZYCCD_CUDA_CHECK(cub::DeviceMergeSort::StableSortPairs(space_.data(), size, view_.leaf_codes,
                                                             view_.leaf_groups, view_.group_count,
                                                             Less{}, stream));
    return;
  }
  cub::DoubleBuffer<std::uint64_t> codes(leaf_codes_[0].data(), leaf_codes_[1].data());
  cub::DoubleBuffer<std::int32_t> groups(leaf_groups_[0].data(), leaf_groups_[1].data());
  LAZYCCD_CUDA_CHECK(cub::DeviceRadixSort::SortPairs(space_.data(), size, codes, groups,
                                                     view_.group_count, 0, kCodeBits, stream));
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
  view_.leaf_codes = leaf_codes_[0].data();
  view_.leaf_groups = leaf_groups_[0].data();
  const std::uint32_t blocks = blocks_for(group_count * kGroupCells, kBlock);
  count_contents<<<blocks, kBlock, 0, stream>>>(view_, start);
  LAZYCCD_CUDA_CHECK(cudaGetLastError());
  std::size_t size = space_size_;
  LAZYCCD_CUDA_CHECK(cub::DeviceScan::ExclusiveSum(space_.data(), size, view_.block_counts,
                                                   view_.first_blocks, view_.group_count, stream));
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

std::size_t HierarchyBuilder::bytes() const {
  std::size_t sum = face_edges_.bytes() + primitives_.bytes() + segments_.bytes() +
                    worlds_.bytes() + bounds_.bytes() + order_.bytes() + first_of_vertex_.bytes() +
                    first_of_edge_.bytes() + owned_.bytes() + block_counts_.bytes() +
                    first_blocks_.bytes() + inner_.bytes() + links_.bytes() + space_.bytes();
  for (int i = 0; i < 2; ++i)
    sum += codes_[i].bytes() + cells_[i].bytes() + segment_keys_[i].bytes() +
           leaf_codes_[i].bytes() + leaf_groups_[i].bytes();
  return sum;
}

}  // namespace lazyccd::gpu
