#include "cpu/bvh/groups.h"

#include <algorithm>
#include <limits>

namespace lazyccd {
namespace {

constexpr std::size_t kCells = 1 << 12;  // cells that a thread takes at a time
constexpr std::size_t kFill = 64;        // groups that a thread takes at a time

// The edges and vertices of a cell, in the order in which a group lists them.
struct CellContents {
  int edges, vertices;
  std::int32_t edge[3], vertex[3];

  CellContents(const Mesh& mesh, bool is_face, std::int32_t cell)
      : edges(is_face ? 3 : 1), vertices(is_face ? 3 : 2) {
    if (is_face) {
      std::copy_n(mesh.face_edges()[cell].data(), 3, edge);
      std::copy_n(mesh.faces()[cell].data(), 3, vertex);
    } else {
      edge[0] = cell;
      std::copy_n(mesh.edges()[cell].data(), 2, vertex);
    }
  }
  // The vertices of an edge, as in Mesh::edges().
  Edge ends(int i) const {
    const std::int32_t a = vertex[i], b = vertex[(i + 1) % vertices];
    return {std::min(a, b), std::max(a, b)};
  }
};

}  // namespace

void Groups::build(const Mesh& mesh, const std::vector<VertexRecord>& vertices, ThreadPool& pool,
                   double scale) {
  order_.build(mesh, vertices, pool);
  claim_primitives(mesh, pool);
  count_primitives(mesh, pool);
  box_vertices(vertices, pool, scale);
  boxes_.resize(groups_.size());
  const VertexBox* const boxes = vertex_boxes_.data() + 1;
  pool.parallel_for(groups_.size(), kFill, [&](std::size_t first, std::size_t last, int) {
    fill_blocks(mesh, first, last);
    kernels_->box_groups(boxes, groups_.data(), first, last, blocks_.data(), boxes_.data());
  });
}

void Groups::claim_primitives(const Mesh& mesh, ThreadPool& pool) {
  constexpr std::uint32_t none = ~std::uint32_t{0};
  first_cell_[kVertices].assign(mesh.vertex_count(), none, pool);
  first_cell_[kEdges].assign(mesh.edges().size(), none, pool);
  pool.parallel_for(order_.size(), kCells, [&](std::size_t begin, std::size_t end, int) {
    mesh.cells().for_each_part(
        begin, end, [&](const CellSegment& segment, std::size_t first, std::size_t last) {
          for (std::size_t i = first; i < last; ++i) {
            const CellContents cell(mesh, segment.has_faces, order_[i]);
            const auto place = static_cast<std::uint32_t>(i);
            for (int k = 0; k < cell.edges; ++k) first_cell_[kEdges].lower(cell.edge[k], place);
            for (int k = 0; k < cell.vertices; ++k)
              first_cell_[kVertices].lower(cell.vertex[k], place);
          }
        });
  });
}

// Calls f(place) for the cells of a group of the segment.
template <class F>
void for_each_cell(const CellSegment& segment, std::size_t group, F&& f) {
  const std::size_t first = static_cast<std::size_t>(segment.first) +
                            (group - static_cast<std::size_t>(segment.first_group)) * kGroupCells;
  const std::size_t last =
      std::min(first + kGroupCells, static_cast<std::size_t>(segment.first + segment.count));
  for (std::size_t i = first; i < last; ++i) f(i);
}

void Groups::count_primitives(const Mesh& mesh, ThreadPool& pool) {
  const Cells& cells = mesh.cells();
  groups_.resize(cells.group_count());
  owned_.resize(order_.size());
  pool.parallel_for(groups_.size(), 4 * kFill, [&](std::size_t begin, std::size_t end, int) {
    cells.for_each_part_of_groups(
        begin, end, [&](const CellSegment& segment, std::size_t first, std::size_t last) {
          for (std::size_t g = first; g < last; ++g) {
            int counts[3] = {};
            for_each_cell(segment, g, [&](std::size_t place) {
              const CellContents cell(mesh, segment.has_faces, order_[place]);
              Owned owned{};
              for (int k = 0; k < cell.edges; ++k)
                owned.edges |= (first_cell_[kEdges][cell.edge[k]] == place) << k;
              for (int k = 0; k < cell.vertices; ++k)
                owned.vertices |= (first_cell_[kVertices][cell.vertex[k]] == place) << k;
              owned_[place] = owned;
              for (int k = 0; k < 3; ++k) {
                counts[kVertices] += owned.vertices >> k & 1;
                counts[kEdges] += owned.edges >> k & 1;
              }
              counts[kFaces] += segment.has_faces;
            });
            groups_[g] = {segment.body, 1, {}, {counts[0], counts[1], counts[2]}};
          }
        });
  });
  std::int32_t block_count = 0;
  for (Group& group : groups_)
    for (int kind = 0; kind < 3; ++kind) {
      group.first[kind] = block_count;
      block_count += group.blocks(kind);
    }
  blocks_.clear();  // so that growing copies nothing
  blocks_.resize(static_cast<std::size_t>(block_count));
}

void Groups::fill_blocks(const Mesh& mesh, std::size_t begin, std::size_t end) {
  mesh.cells().for_each_part_of_groups(
      begin, end, [&](const CellSegment& segment, std::size_t first, std::size_t last) {
        for (std::size_t g = first; g < last; ++g) fill_group(mesh, segment, g);
      });
}

void Groups::fill_group(const Mesh& mesh, const CellSegment& segment, std::size_t g) {
  Group& group = groups_[g];
  for (int kind = 0; kind < 3; ++kind)
    for (int i = 0; i < group.blocks(kind); ++i) {
      Block& block = blocks_[group.first[kind] + i];
      std::fill_n(block.id, kBlockLanes, -1);
      for (auto& corner : block.vertex) std::fill_n(corner, kBlockLanes, -1);
    }
  int filled[3] = {};
  const auto add = [&](int kind, std::int32_t id, const std::int32_t* vertices, int count) {
    const int place = filled[kind]++, lane = place % kBlockLanes;
    Block& block = blocks_[group.first[kind] + place / kBlockLanes];
    block.id[lane] = id;
    for (int k = 0; k < count; ++k) block.vertex[k][lane] = vertices[k];
  };
  for_each_cell(segment, g, [&](std::size_t place) {
    const CellContents cell(mesh, segment.has_faces, order_[place]);
    const Owned owned = owned_[place];
    if (segment.has_faces) add(kFaces, order_[place], cell.vertex, 3);
    for (int k = 0; k < cell.edges; ++k)
      if (owned.edges >> k & 1) add(kEdges, cell.edge[k], cell.ends(k).data(), 2);
    for (int k = 0; k < cell.vertices; ++k)
      if (owned.vertices >> k & 1) add(kVertices, cell.vertex[k], cell.vertex + k, 1);
    // What a group owns has no other vertices than its cells have.
    for (int k = 0; k < cell.vertices; ++k)
      if (!mesh.pinned(cell.vertex[k])) group.pinned = 0;
  });
}

void Groups::box_vertices(const std::vector<VertexRecord>& vertices, ThreadPool& pool,
                          double scale) {
  // The first box is empty; it stands for the vertices of unused lanes (index -1).
  vertex_boxes_.resize(1 + vertices.size());
  for (float& side : vertex_boxes_.front().side) side = -std::numeric_limits<float>::infinity();
  VertexBox* const boxes = vertex_boxes_.data() + 1;
  pool.parallel_for(vertices.size(), 1024, [&](std::size_t first, std::size_t last, int) {
    kernels_->box_vertices(vertices.data()->x, scale, margin_ * scale, first, last, boxes);
  });
}

void Groups::refit(const std::vector<VertexRecord>& vertices, ThreadPool& pool, double scale) {
  box_vertices(vertices, pool, scale);
  const VertexBox* const boxes = vertex_boxes_.data() + 1;
  pool.parallel_for(groups_.size(), kFill, [&](std::size_t first, std::size_t last, int) {
    kernels_->box_groups(boxes, groups_.data(), first, last, blocks_.data(), boxes_.data());
  });
}

std::size_t Groups::bytes() const {
  return groups_.capacity() * sizeof(Group) + blocks_.capacity() * sizeof(Block) +
         boxes_.capacity() * sizeof(MotionBox) + vertex_boxes_.capacity() * sizeof(VertexBox) +
         order_.bytes() + first_cell_[0].bytes() + first_cell_[1].bytes() +
         owned_.capacity() * sizeof(Owned);
}

}  // namespace lazyccd
