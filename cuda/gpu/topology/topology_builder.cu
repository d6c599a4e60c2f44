// Sorts, sums and launches that find edges and cells.
#include "gpu/topology/topology_builder.h"

#include <algorithm>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>
#include <limits>
#include <numeric>

#include "core/narrow/contact_key.h"
#include "gpu/device/carver.h"
#include "gpu/topology/edge_kernels.cuh"

namespace lazyccd::gpu {
namespace {

constexpr std::uint32_t kBlock = 256;

}  // namespace

/// The arrays in the workspace.
struct TopologyBuilder::Arrays {
  std::uint64_t* keys[2];     // of the sides; the second becomes `first`
  std::uint32_t* numbers[2];  // of the sides; the second becomes `free`
  std::uint32_t *first, *free;
  std::uint32_t* cell_keys[2];
  std::int32_t* cells[2];
  std::int32_t* free_edges;
  Edge* more_edges;
  std::int32_t* ranks;
  std::uint32_t* starts;  // two per body: of its faces, of its free edges
  TopologyReport* report;
  char* space;
  std::size_t space_bytes;

  Arrays(Carver& carver, const TopologyInput& input)
      : first(nullptr), free(nullptr), space_bytes(most_space(input)) {
    const std::size_t sides = 3 * input.faces.size() + input.edges.size();
    const std::size_t most_cells = input.faces.size() + input.edges.size();
    const auto of_sides = [&](Carver part) {
      for (int i = 0; i < 2; ++i) {
        keys[i] = part.take<std::uint64_t>(sides);
        numbers[i] = part.take<std::uint32_t>(sides);
      }
      return part.used();
    };
    const auto of_cells = [&](Carver part) {
      for (int i = 0; i < 2; ++i) {
        cell_keys[i] = part.take<std::uint32_t>(most_cells);
        cells[i] = part.take<std::int32_t>(most_cells);
      }
      return part.used();
    };
    // The cells are listed when the sides are no longer needed.
    char* const shared =
        carver.take<char>(std::max(of_sides(Carver(nullptr)), of_cells(Carver(nullptr))));
    of_sides(Carver(shared));
    of_cells(Carver(shared));
    free_edges = carver.take<std::int32_t>(input.edges.size());
    more_edges = carver.take<Edge>(input.edges.size());
    ranks = carver.take<std::int32_t>(input.body_count);
    starts = carver.take<std::uint32_t>(2 * input.body_count);
    report = carver.take<TopologyReport>(1);
    space = carver.take<char>(space_bytes);
  }

 private:
  static std::size_t most_space(const TopologyInput& input) {
    const int sides = static_cast<int>(3 * input.faces.size() + input.edges.size());
    const int cells = static_cast<int>(input.faces.size() + input.edges.size());
    std::size_t most = 1, bytes = 0;
    const auto note = [&](cudaError_t result) {
      LAZYCCD_CUDA_CHECK(result);
      most = std::max(most, bytes);
    };
    cub::DoubleBuffer<std::uint64_t> keys;
    cub::DoubleBuffer<std::uint32_t> numbers, cell_keys;
    cub::DoubleBuffer<std::int32_t> cell;
    std::uint32_t* marks = nullptr;
    note(cub::DeviceRadixSort::SortPairs(nullptr, bytes, keys, numbers, sides, 0, 64));
    note(cub::DeviceScan::InclusiveSum(nullptr, bytes, marks, marks, sides));
    note(cub::DeviceRadixSort::SortPairs(nullptr, bytes, cell_keys, cell, cells, 0, 32));
    return most;
  }
};

TopologyBuilder::TopologyBuilder() { report_.reserve(1); }
TopologyBuilder::~TopologyBuilder() = default;

void TopologyBuilder::upload_input(const TopologyInput& input, DeviceMesh& mesh,
                                   const Arrays& arrays, ThreadPool& pool, cudaStream_t stream) {
  const auto copy = [&](void* to, const auto& from) {
    upload_.copy(to, from.data(), from.size() * sizeof(from[0]), pool, stream);
  };
  mesh.faces.reserve(std::max<std::size_t>(input.faces.size(), 1));
  mesh.body_of_vertex.reserve(std::max<std::size_t>(input.body_of_vertex.size(), 1));
  copy(mesh.body_of_vertex.data(), input.body_of_vertex);
  copy(mesh.faces.data(), input.faces);
  copy(arrays.more_edges, input.edges);
  bodies_.resize(input.body_count);
  std::iota(bodies_.begin(), bodies_.end(), 0);
  ranks_.clear();
  const Span<const std::int32_t> worlds = input.world_of_body;
  if (std::is_sorted(worlds.begin(), worlds.end())) return;
  std::stable_sort(bodies_.begin(), bodies_.end(),
                   [&](std::int32_t a, std::int32_t b) { return worlds[a] < worlds[b]; });
  ranks_.resize(input.body_count);
  for (std::size_t i = 0; i < bodies_.size(); ++i)
    ranks_[static_cast<std::size_t>(bodies_[i])] = static_cast<std::int32_t>(i);
  copy(arrays.ranks, ranks_);
}

void TopologyBuilder::sort_sides(const SideView& view, Arrays& arrays, cudaStream_t stream) {
  const std::uint32_t sides = 3 * view.face_count + view.edge_count;
  list_sides<<<blocks_for(view.face_count + view.edge_count, kBlock), kBlock, 0, stream>>>(
      view, arrays.keys[0], arrays.numbers[0], arrays.report);
  LAZYCCD_CUDA_CHECK(cudaGetLastError());
  cub::DoubleBuffer<std::uint64_t> keys(arrays.keys[0], arrays.keys[1]);
  cub::DoubleBuffer<std::uint32_t> numbers(arrays.numbers[0], arrays.numbers[1]);
  // Stable: the sides of an edge stay in the order of their numbers.
  LAZYCCD_CUDA_CHECK(cub::DeviceRadixSort::SortPairs(arrays.space, arrays.space_bytes, keys,
                                                     numbers, static_cast<int>(sides), 0,
                                                     2 * view.vertex_bits, stream));
  arrays.keys[0] = keys.Current();
  arrays.first = reinterpret_cast<std::uint32_t*>(keys.Alternate());
  arrays.numbers[0] = numbers.Current();
  arrays.free = view.edge_count == 0 ? nullptr : numbers.Alternate();
}

void TopologyBuilder::sum_marks(const SideView& view, const Arrays& arrays, cudaStream_t stream) {
  const std::uint32_t sides = 3 * view.face_count + view.edge_count;
  mark_edges<<<blocks_for(sides, kBlock), kBlock, 0, stream>>>(
      view, arrays.keys[0], arrays.numbers[0], arrays.first, arrays.free);
  LAZYCCD_CUDA_CHECK(cudaGetLastError());
  for (std::uint32_t* marks : {arrays.first, arrays.free}) {
    std::size_t bytes = arrays.space_bytes;
    if (marks != nullptr)
      LAZYCCD_CUDA_CHECK(cub::DeviceScan::InclusiveSum(arrays.space, bytes, marks, marks,
                                                       static_cast<int>(sides), stream));
  }
  count_edges<<<1, 1, 0, stream>>>(view, arrays.first, arrays.free, arrays.report);
  LAZYCCD_CUDA_CHECK(cudaGetLastError());
}

void TopologyBuilder::read_report(const Arrays& arrays, cudaStream_t stream) {
  LAZYCCD_CUDA_CHECK(cudaMemcpyAsync(report_.data(), arrays.report, sizeof(TopologyReport),
                                     cudaMemcpyDeviceToHost, stream));
  LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(stream));
}

void TopologyBuilder::sort_cells(Arrays& arrays, cudaStream_t stream) {
  cub::DoubleBuffer<std::uint32_t> keys(arrays.cell_keys[0], arrays.cell_keys[1]);
  cub::DoubleBuffer<std::int32_t> cells(arrays.cells[0], arrays.cells[1]);
  LAZYCCD_CUDA_CHECK(cub::DeviceRadixSort::SortPairs(
      arrays.space, arrays.space_bytes, keys, cells, static_cast<int>(cell_count_), 0,
      std::max(bits_for(2 * bodies_.size()), 1), stream));
  arrays.cell_keys[0] = keys.Current();
  arrays.cells[0] = cells.Current();
}

std::vector<CellSegment> TopologyBuilder::read_segments(const Arrays& arrays, cudaStream_t stream) {
  const std::size_t keys = 2 * bodies_.size(), bytes = keys * sizeof(std::uint32_t);
  starts_.reserve(keys);
  LAZYCCD_CUDA_CHECK(cudaMemsetAsync(arrays.starts, 0xff, bytes, stream));
  find_starts<<<blocks_for(cell_count_, kBlock), kBlock, 0, stream>>>(arrays.cell_keys[0],
                                                                      cell_count_, arrays.starts);
  LAZYCCD_CUDA_CHECK(cudaGetLastError());
  LAZYCCD_CUDA_CHECK(
      cudaMemcpyAsync(starts_.data(), arrays.starts, bytes, cudaMemcpyDeviceToHost, stream));
  read_report(arrays, stream);
  std::vector<CellSegment> segments;
  if (report_.data()->unsorted != 0) return segments;
  constexpr std::uint32_t none = ~std::uint32_t{0};
  std::uint32_t end = cell_count_;
  for (std::size_t key = keys; key-- > 0;) {  // from the back, so that the end is known
    const std::uint32_t start = starts_.data()[key];
    if (start == none) continue;
    segments.push_back({bodies_[key / 2], key % 2 == 0, static_cast<std::int32_t>(start),
                        static_cast<std::int32_t>(end - start), 0});
    end = start;
  }
  std::reverse(segments.begin(), segments.end());
  std::int32_t groups = 0;
  for (CellSegment& segment : segments) {
    segment.first_group = groups;
    groups += segment.groups();
  }
  return segments;
}

FoundTopology TopologyBuilder::build(const TopologyInput& input, DeviceScene& scene,
                                     ThreadPool& pool, cudaStream_t stream) {
  FoundTopology found;
  const std::size_t sides = 3 * input.faces.size() + input.edges.size();
  if (sides == 0) return found;
  if (sides > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max()))
    throw Error(ErrorCode::device, "so many faces need the host to find their edges");
  DeviceMesh& mesh = scene.mesh();
  Carver sizes(nullptr);
  static_cast<void>(Arrays(sizes, input));
  Carver carver(scene.workspace(sizes.used()));
  Arrays arrays(carver, input);
  LAZYCCD_CUDA_CHECK(cudaMemsetAsync(arrays.report, 0, sizeof(TopologyReport), stream));
  upload_input(input, mesh, arrays, pool, stream);
  const SideView view{reinterpret_cast<const std::int32_t(*)[3]>(mesh.faces.data()),
                      reinterpret_cast<const std::int32_t(*)[2]>(arrays.more_edges),
                      static_cast<std::uint32_t>(input.faces.size()),
                      static_cast<std::uint32_t>(input.edges.size()),
                      static_cast<std::uint32_t>(input.body_of_vertex.size()),
                      mesh.body_of_vertex.data(),
                      std::max(bits_for(input.body_of_vertex.size()), 1)};
  sort_sides(view, arrays, stream);
  sum_marks(view, arrays, stream);
  read_report(arrays, stream);
  const TopologyReport& report = *report_.data();
  found.is_valid = report.invalid == 0;
  if (!found.is_valid) return found;
  found.edge_count = report.edge_count;
  const bool has_free_edges = report.free_edge_count != 0;
  cell_count_ = view.face_count + report.free_edge_count;

  mesh.edges.reserve(found.edge_count);
  mesh.face_edges.reserve(std::max<std::size_t>(3 * input.faces.size(), 1));
  auto* const edges = reinterpret_cast<std::int32_t(*)[2]>(mesh.edges.data());
  write_edges<<<blocks_for(sides, kBlock), kBlock, 0, stream>>>(
      view, arrays.keys[0], arrays.numbers[0], arrays.first, arrays.free,
      EdgeOutput{edges, mesh.face_edges.data(), has_free_edges ? arrays.free_edges : nullptr},
      arrays.report);
  list_cells<<<blocks_for(cell_count_, kBlock), kBlock, 0, stream>>>(
      view, edges, arrays.free_edges, ranks_.empty() ? nullptr : arrays.ranks, cell_count_,
      arrays.cell_keys[0], arrays.cells[0], arrays.report);
  LAZYCCD_CUDA_CHECK(cudaGetLastError());
  found.segments = read_segments(arrays, stream);
  const bool unsorted = report.unsorted != 0;
  if (unsorted) {
    sort_cells(arrays, stream);
    LAZYCCD_CUDA_CHECK(cudaMemsetAsync(&arrays.report->unsorted, 0, sizeof(std::uint32_t), stream));
    found.segments = read_segments(arrays, stream);
  }
  found.is_valid = report.invalid == 0;
  mesh.has_primitives = unsorted || has_free_edges;
  if (mesh.has_primitives) {
    mesh.primitives.reserve(cell_count_);
    LAZYCCD_CUDA_CHECK(cudaMemcpyAsync(mesh.primitives.data(), arrays.cells[0],
                                       cell_count_ * sizeof(std::int32_t), cudaMemcpyDeviceToDevice,
                                       stream));
    LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(stream));
  }
  return found;
}

}  // namespace lazyccd::gpu
