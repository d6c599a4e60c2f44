#include "cpu/bvh/groups.h"

#include <algorithm>
#include <limits>

#include "core/bvh/morton.h"

namespace lazyccd {
namespace {

// A face or a free edge, with the keys by which cells are sorted.
struct Cell {
  std::uint64_t code;
  std::int32_t body;
  std::int32_t primitive;  // face index, or edge index of a free edge
  bool face;

  bool operator<(const Cell& o) const {
    if (body != o.body) return body < o.body;
    if (face != o.face) return face;
    if (code != o.code) return code < o.code;
    return primitive < o.primitive;
  }
};

template <std::size_t N>
std::array<double, 3> centroid(const std::array<std::int32_t, N>& v,
                               const std::vector<VertexRecord>& vertices) {
  std::array<double, 3> c{};
  for (const std::int32_t i : v)
    for (int k = 0; k < 3; ++k) c[k] += vertices[i].x[k] / static_cast<double>(N);
  return c;
}

std::vector<Cell> sorted_cells(const Mesh& mesh, const std::vector<VertexRecord>& vertices) {
  std::array<double, 3> lo, hi;
  lo.fill(std::numeric_limits<double>::max());
  hi.fill(std::numeric_limits<double>::lowest());
  for (const VertexRecord& v : vertices) {
    for (int k = 0; k < 3; ++k) {
      lo[k] = std::min(lo[k], v.x[k]);
      hi[k] = std::max(hi[k], v.x[k]);
    }
  }
  // The same scale for all axes, so that the cells of the Morton code are cubes.
  double extent = 0;
  for (int k = 0; k < 3; ++k) extent = std::max(extent, hi[k] - lo[k]);
  const double scale = extent > 0 ? 1 / extent : 0;
  const auto code = [&](const std::array<double, 3>& c) {
    return morton_code((c[0] - lo[0]) * scale, (c[1] - lo[1]) * scale, (c[2] - lo[2]) * scale);
  };

  std::vector<Cell> cells;
  cells.reserve(mesh.faces().size() + mesh.free_edges().size());
  for (std::size_t f = 0; f < mesh.faces().size(); ++f) {
    const Face& face = mesh.faces()[f];
    cells.push_back({code(centroid(face, vertices)), mesh.body_of_vertex()[face[0]],
                     static_cast<std::int32_t>(f), true});
  }
  for (const std::int32_t e : mesh.free_edges()) {
    const Edge& edge = mesh.edges()[e];
    cells.push_back({code(centroid(edge, vertices)), mesh.body_of_vertex()[edge[0]], e, false});
  }
  std::sort(cells.begin(), cells.end());
  return cells;
}

// Collects the primitives of one kind, group by group. Each primitive is collected once.
class Collector {
 public:
  explicit Collector(std::size_t primitives) : owned_(primitives, 0) {}
  void claim(std::int32_t id) {
    if (owned_[id]) return;
    owned_[id] = 1;
    ids.push_back(id);
  }
  std::vector<std::int32_t> ids;

 private:
  std::vector<char> owned_;
};

}  // namespace

void Groups::build(const Mesh& mesh, const std::vector<VertexRecord>& vertices, ThreadPool& pool,
                   double scale) {
  groups_.clear();
  blocks_.clear();
  const std::vector<Cell> cells = sorted_cells(mesh, vertices);
  Collector own[3] = {Collector(mesh.vertex_count()), Collector(mesh.edges().size()),
                      Collector(mesh.faces().size())};

  std::size_t collected[3] = {};
  std::int32_t block_count = 0;
  for (std::size_t begin = 0; begin < cells.size();) {
    const Cell& first = cells[begin];
    std::size_t end = begin;
    for (; end < cells.size() && end - begin < kGroupCells; ++end) {
      const Cell& cell = cells[end];
      if (cell.body != first.body || cell.face != first.face) break;
      if (cell.face) {
        own[kFaces].claim(cell.primitive);
        for (const std::int32_t e : mesh.face_edges()[cell.primitive]) own[kEdges].claim(e);
        for (const std::int32_t v : mesh.faces()[cell.primitive]) own[kVertices].claim(v);
      } else {
        own[kEdges].claim(cell.primitive);
        for (const std::int32_t v : mesh.edges()[cell.primitive]) own[kVertices].claim(v);
      }
    }
    begin = end;

    Group group{};
    group.body = first.body;
    group.pinned = 1;
    for (int kind = 0; kind < 3; ++kind) {
      group.first[kind] = block_count;
      group.count[kind] = static_cast<std::int32_t>(own[kind].ids.size() - collected[kind]);
      collected[kind] = own[kind].ids.size();
      block_count += group.blocks(kind);
    }
    groups_.push_back(group);
  }

  // Allocated at once, because the blocks are a large part of a detector's memory.
  blocks_.resize(static_cast<std::size_t>(block_count));
  const std::int32_t* ids[3] = {own[kVertices].ids.data(), own[kEdges].ids.data(),
                                own[kFaces].ids.data()};
  for (Group& group : groups_) {
    for (int kind = 0; kind < 3; ++kind) {
      Block* block = blocks_.data() + group.first[kind];
      const int lanes = group.blocks(kind) * kBlockLanes;
      for (int lane = 0; lane < lanes; ++lane) {
        Block& b = block[lane / kBlockLanes];
        const int l = lane % kBlockLanes;
        b.id[l] = b.vertex[0][l] = b.vertex[1][l] = b.vertex[2][l] = -1;
        if (lane >= group.count[kind]) continue;
        const std::int32_t id = ids[kind][lane];
        b.id[l] = id;
        if (kind == kVertices) b.vertex[0][l] = id;
        if (kind == kEdges)
          for (int k = 0; k < 2; ++k) b.vertex[k][l] = mesh.edges()[id][k];
        if (kind == kFaces)
          for (int k = 0; k < 3; ++k) b.vertex[k][l] = mesh.faces()[id][k];
        for (int k = 0; k < 3 && b.vertex[k][l] >= 0; ++k)
          if (!mesh.pinned(b.vertex[k][l])) group.pinned = 0;
      }
      ids[kind] += group.count[kind];
    }
  }
  boxes_.resize(groups_.size());
  refit(vertices, pool, scale);
}

void Groups::refit(const std::vector<VertexRecord>& vertices, ThreadPool& pool, double scale) {
  // The first box is empty; it stands for the vertices of unused lanes (index -1).
  vertex_boxes_.resize(1 + vertices.size());
  for (float& side : vertex_boxes_.front().side) side = -std::numeric_limits<float>::infinity();
  VertexBox* const boxes = vertex_boxes_.data() + 1;
  pool.parallel_for(vertices.size(), 1024, [&](std::size_t first, std::size_t last, int) {
    kernels_->box_vertices(vertices.data()->x, scale, margin_ * scale, first, last, boxes);
  });
  pool.parallel_for(groups_.size(), 64, [&](std::size_t first, std::size_t last, int) {
    kernels_->box_groups(boxes, groups_.data(), first, last, blocks_.data(), boxes_.data());
  });
}

std::size_t Groups::bytes() const {
  return groups_.capacity() * sizeof(Group) + blocks_.capacity() * sizeof(Block) +
         boxes_.capacity() * sizeof(MotionBox) + vertex_boxes_.capacity() * sizeof(VertexBox);
}

}  // namespace lazyccd
