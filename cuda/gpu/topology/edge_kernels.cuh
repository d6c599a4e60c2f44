// Kernels that find the edges from the faces, as host/scene/edge_table.cpp does: the sides of the
// faces are sorted by their vertices, and equal neighbours are one edge.
#pragma once

#include <cstdint>

#include "gpu/device/kernel_chain.cuh"

namespace lazyccd::gpu {

/// What the kernels report.
struct TopologyReport {
  std::uint32_t edge_count, free_edge_count;
  std::uint32_t invalid;   // a face or edge is invalid, or two faces have the same vertices
  std::uint32_t unsorted;  // the cells are not in order
};

/// Faces and further edges on the device. A side is a side of a face, or such an edge. Its number
/// is 3 * face + side, or one beyond those.
struct SideView {
  const std::int32_t (*faces)[3];
  const std::int32_t (*edges)[2];
  std::uint32_t face_count, edge_count, vertex_count;
  const std::int32_t* body_of_vertex;
  int vertex_bits;  // of the index of a vertex

  __device__ std::uint32_t of_faces() const { return 3 * face_count; }
  __device__ std::uint32_t sides() const { return of_faces() + edge_count; }
  /// Sorts by the larger vertex, then by the smaller one.
  __device__ std::uint64_t key(std::int32_t a, std::int32_t b) const {
    const auto larger = static_cast<std::uint64_t>(max(a, b));
    return larger << vertex_bits | static_cast<std::uint64_t>(min(a, b));
  }
  __device__ int2 vertices(std::uint64_t key) const {
    const std::uint64_t mask = (std::uint64_t{1} << vertex_bits) - 1;
    return {static_cast<std::int32_t>(key & mask), static_cast<std::int32_t>(key >> vertex_bits)};
  }
  /// Whether the vertices are different ones of one body.
  template <int N>
  __device__ bool is_valid(const std::int32_t (&v)[N]) const {
    for (int k = 0; k < N; ++k)
      if (static_cast<std::uint32_t>(v[k]) >= vertex_count) return false;
    for (int k = 0; k < N; ++k)
      if (v[k] == v[(k + 1) % N] || body_of_vertex[v[k]] != body_of_vertex[v[0]]) return false;
    return true;
  }
  /// The vertex of a face that is not on its side.
  __device__ std::int32_t third_vertex(std::uint32_t side) const {
    return faces[side / 3][(side + 2) % 3];
  }
};

/// Lists the sides; one thread per face or edge.
__global__ void list_sides(SideView view, std::uint64_t* keys, std::uint32_t* numbers,
                           TopologyReport* report) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= view.face_count + view.edge_count) return;
  bool valid;
  if (i < view.face_count) {
    const auto& face = view.faces[i];
    valid = view.is_valid(face);
    for (int k = 0; k < 3; ++k) {
      keys[3 * i + k] = valid ? view.key(face[k], face[(k + 1) % 3]) : 0;
      numbers[3 * i + k] = 3 * i + k;
    }
  } else {
    const auto& edge = view.edges[i - view.face_count];
    const std::uint32_t side = view.of_faces() + i - view.face_count;
    valid = view.is_valid(edge);
    keys[side] = valid ? view.key(edge[0], edge[1]) : 0;
    numbers[side] = side;
  }
  if (!valid) report->invalid = 1;
}

/// Whether a sorted side is the first one of its edge.
__device__ inline bool is_first(const std::uint64_t* keys, std::uint32_t i) {
  return i == 0 || keys[i] != keys[i - 1];
}

/// Marks the first sides of the edges, and those of free edges if `free` is not null; one thread
/// per sorted side. Sides of faces come first, so the first side tells whether an edge is free.
__global__ void mark_edges(SideView view, const std::uint64_t* keys, const std::uint32_t* numbers,
                           std::uint32_t* first, std::uint32_t* free) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= view.sides()) return;
  const bool own = is_first(keys, i);
  first[i] = own;
  if (free != nullptr) free[i] = own && numbers[i] >= view.of_faces();
}

/// Takes the totals from the sums over all marks.
__global__ void count_edges(SideView view, const std::uint32_t* first, const std::uint32_t* free,
                            TopologyReport* report) {
  report->edge_count = first[view.sides() - 1];
  report->free_edge_count = free == nullptr ? 0 : free[view.sides() - 1];
}

/// Where write_edges() writes. free_edges may be null if there are none.
struct EdgeOutput {
  std::int32_t (*edges)[2];
  std::int32_t* face_edges;  // three per face
  std::int32_t* free_edges;
};

/// Writes the edges, from the sums over the marks; one thread per sorted side.
__global__ void write_edges(SideView view, const std::uint64_t* keys, const std::uint32_t* numbers,
                            const std::uint32_t* first, const std::uint32_t* free,
                            EdgeOutput output, TopologyReport* report) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= view.sides()) return;
  const std::uint64_t key = keys[i];
  const std::uint32_t number = numbers[i], of_faces = view.of_faces();
  const auto edge = static_cast<std::int32_t>(first[i] - 1);
  if (is_first(keys, i)) {
    const int2 v = view.vertices(key);
    output.edges[edge][0] = v.x;
    output.edges[edge][1] = v.y;
    if (number >= of_faces && output.free_edges != nullptr) output.free_edges[free[i] - 1] = edge;
  }
  if (number >= of_faces) return;
  output.face_edges[number] = edge;
  // Two faces at an edge with the same third vertex are the same face.
  for (std::uint32_t j = i + 1; j < view.sides() && keys[j] == key && numbers[j] < of_faces; ++j)
    if (view.third_vertex(numbers[j]) == view.third_vertex(number)) report->invalid = 1;
}

/// Lists the cells by body: all faces, then all free edges. ranks: by body, its place in the order
/// of the worlds; null: its index. One thread per cell.
__global__ void list_cells(SideView view, const std::int32_t (*edges)[2],
                           const std::int32_t* free_edges, const std::int32_t* ranks,
                           std::uint32_t cell_count, std::uint32_t* keys, std::int32_t* primitives,
                           TopologyReport* report) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= cell_count) return;
  const auto key_of = [&](std::uint32_t cell) {
    const bool is_face = cell < view.face_count;
    const std::int32_t vertex =
        is_face ? view.faces[cell][0] : edges[free_edges[cell - view.face_count]][0];
    const std::int32_t body = view.body_of_vertex[vertex];
    const auto rank = static_cast<std::uint32_t>(ranks == nullptr ? body : ranks[body]);
    return 2 * rank + (is_face ? 0 : 1);
  };
  const std::uint32_t key = key_of(i);
  keys[i] = key;
  primitives[i] =
      i < view.face_count ? static_cast<std::int32_t>(i) : free_edges[i - view.face_count];
  if (i != 0 && key_of(i - 1) > key) report->unsorted = 1;
}

/// Finds the first cell of each key; one thread per sorted cell.
__global__ void find_starts(const std::uint32_t* keys, std::uint32_t cell_count,
                            std::uint32_t* starts) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < cell_count && (i == 0 || keys[i] != keys[i - 1])) starts[keys[i]] = i;
}

}  // namespace lazyccd::gpu
