#include "host/bvh/groups.h"

#include <algorithm>
#include <limits>

#include "core/bvh/morton.h"

namespace lazyccd {
namespace {

constexpr std::size_t kCells = 1 << 12;  // cells that a thread takes at a time
constexpr std::size_t kFill = 64;        // groups that a thread takes at a time

}  // namespace

void Groups::build(const Mesh& mesh, const std::vector<VertexRecord>& vertices, ThreadPool& pool,
                   double scale) {
  order_.build(mesh, vertices, pool);
  claim_primitives(mesh, pool);
  count_primitives(mesh, vertices, pool);
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
  const CellView view = mesh.cell_view();
  pool.parallel_for(order_.size(), kCells, [&](std::size_t begin, std::size_t end, int) {
    mesh.cells().for_each_part(
        begin, end, [&](const CellSegment& segment, std::size_t first, std::size_t last) {
          for (std::size_t i = first; i < last; ++i) {
            const CellContents cell(view, segment.has_faces, order_[i]);
            const auto place = static_cast<std::uint32_t>(i);
            for (int k = 0; k < cell.edges; ++k)
              if (!mesh.leaves_out_edge(cell.edge[k]))
                first_cell_[kEdges].lower(cell.edge[k], place);
            for (int k = 0; k < cell.vertices; ++k)
              if (!mesh.leaves_out_vertex(cell.vertex[k]))
                first_cell_[kVertices].lower(cell.vertex[k], place);
          }
        });
  });
}

void Groups::count_primitives(const Mesh& mesh, const std::vector<VertexRecord>& vertices,
                              ThreadPool& pool) {
  const Cells& cells = mesh.cells();
  const CellView view = mesh.cell_view();
  groups_.resize(cells.group_count());
  codes_.resize(groups_.size());
  const Span<const std::int32_t> world_of_body = mesh.world_of_body();
  worlds_.resize(world_of_body.empty() ? 0 : groups_.size());
  owned_.resize(order_.size());
  pool.parallel_for(groups_.size(), 4 * kFill, [&](std::size_t begin, std::size_t end, int) {
    cells.for_each_part_of_groups(
        begin, end, [&](const CellSegment& segment, std::size_t first, std::size_t last) {
          for (std::size_t g = first; g < last; ++g) {
            const CellRange range = segment.cells_of(static_cast<std::int32_t>(g));
            int counts[3] = {0, 0, segment.has_faces ? range.last - range.first : 0};
            PointBox box(
                vertices[CellContents(view, segment.has_faces, order_[range.first]).vertex[0]].x);
            for (std::int32_t i = range.first; i < range.last; ++i) {
              const CellContents cell(view, segment.has_faces, order_[i]);
              for (int k = 0; k < cell.vertices; ++k) box.add(vertices[cell.vertex[k]].x);
              owned_[i] = owned_contents(
                  cell, static_cast<std::uint32_t>(i),
                  [&](std::int32_t e) { return first_cell_[kEdges][e]; },
                  [&](std::int32_t v) { return first_cell_[kVertices][v]; });
              for (int k = 0; k < 3; ++k) {
                counts[kVertices] += owned_[i].vertices >> k & 1;
                counts[kEdges] += owned_[i].edges >> k & 1;
              }
            }
            groups_[g] = {segment.body,
                          1,
                          {},
                          {counts[0], counts[1], counts[2]},
                          0,
                          std::numeric_limits<float>::infinity()};
            codes_[g] = box.centre_code(order_.frame());
            if (!worlds_.empty()) worlds_[g] = world_of_body[segment.body];
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
  const CellView view = mesh.cell_view();
  const CellRange range = segment.cells_of(static_cast<std::int32_t>(g));
  const float* const self_separation = mesh.self_separation();
  for (std::int32_t i = range.first; i < range.last; ++i) {
    const CellContents cell(view, segment.has_faces, order_[i]);
    if (segment.has_faces) add(kFaces, order_[i], cell.vertex, 3);
    for (int k = 0; k < cell.edges; ++k) {
      const std::int32_t ends[2] = {cell.end(k, 0), cell.end(k, 1)};
      if (owned_[i].edges >> k & 1) add(kEdges, cell.edge[k], ends, 2);
    }
    for (int k = 0; k < cell.vertices; ++k)
      if (owned_[i].vertices >> k & 1) add(kVertices, cell.vertex[k], cell.vertex + k, 1);
    // What a group owns has no other vertices than its cells have.
    for (int k = 0; k < cell.vertices; ++k) {
      if (!mesh.pinned(cell.vertex[k])) group.pinned = 0;
      if (self_separation == nullptr) continue;
      const float limit = self_separation[cell.vertex[k]];
      group.self_separation = std::max(group.self_separation, limit);
      group.least_self_separation = std::min(group.least_self_separation, limit);
    }
  }
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
         owned_.capacity() * sizeof(OwnedContents) + codes_.capacity() * sizeof(std::uint64_t) +
         worlds_.capacity() * sizeof(std::int32_t);
}

}  // namespace lazyccd
