#include "cpu/verlet/relative_motion.h"

#include <algorithm>
#include <cmath>

namespace lazyccd {

void RelativeMotionBounds::build(const Mesh& mesh, const Groups& groups, const Tree& tree) {
  const NoinitVector<TreeNode>& nodes = tree.nodes();
  boxes_.resize(nodes.size());
  owner_[kVertices].assign(mesh.vertex_count(), 0);
  owner_[kEdges].assign(mesh.edges().size(), 0);
  owner_[kFaces].assign(mesh.faces().size(), 0);
  leaves_.clear();
  vertices_.clear();
  first_.assign(1, 0);
  constexpr std::uint32_t none = ~std::uint32_t{0};
  std::vector<std::uint32_t> last_leaf(mesh.vertex_count(), none);  // last leaf with this vertex
  for (std::uint32_t node = 0; node < nodes.size(); ++node) {
    if (!nodes[node].leaf()) continue;
    const Group& group = groups.groups()[nodes[node].group()];
    for (int kind = 0; kind < 3; ++kind) {
      const Block* block = groups.blocks().data() + group.first[kind];
      for (int i = 0; i < group.count[kind]; ++i) {
        const Block& b = block[i / kBlockLanes];
        const int lane = i % kBlockLanes;
        owner_[kind][b.id[lane]] = node;
        for (int k = 0; k < 3 && b.vertex[k][lane] >= 0; ++k) {
          const std::int32_t v = b.vertex[k][lane];
          if (last_leaf[v] != node) vertices_.push_back(v);
          last_leaf[v] = node;
        }
      }
    }
    leaves_.push_back(node);
    first_.push_back(static_cast<std::uint32_t>(vertices_.size()));
  }
}

void RelativeMotionBounds::begin(const std::vector<VertexRecord>& records, double scale) {
  scale_ = scale;
  from_.resize(records.size());
  for (std::size_t v = 0; v < records.size(); ++v) {
    const double* x = records[v].x;
    from_[v] = {{x[0], x[1], x[2], x[0], x[1], x[2], 0, 0}};
  }
}

void RelativeMotionBounds::measure(const std::vector<VertexRecord>& records, const Tree& tree,
                                   ThreadPool& pool) {
  pool.parallel_for(leaves_.size(), 128, [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i) measure_leaf(static_cast<std::uint32_t>(i), records);
  });
  const NoinitVector<TreeNode>& nodes = tree.nodes();
  tree.for_each_upward(pool, [&](std::size_t i) {
    if (nodes[i].leaf()) return;
    const Box &left = boxes_[nodes[i].left], &right = boxes_[nodes[i].right];
    for (int k = 0; k < 6; ++k) {
      boxes_[i].lo[k] = std::min(left.lo[k], right.lo[k]);
      boxes_[i].hi[k] = std::max(left.hi[k], right.hi[k]);
    }
  });
}

void RelativeMotionBounds::measure_leaf(std::uint32_t leaf,
                                        const std::vector<VertexRecord>& records) {
  Box box;
  std::fill_n(box.lo, 6, HUGE_VAL);
  std::fill_n(box.hi, 6, -HUGE_VAL);
  for (std::uint32_t i = first_[leaf]; i < first_[leaf + 1]; ++i) {
    const double *x = records[vertices_[i]].x, *from = from_[vertices_[i]].x;
    for (int k = 0; k < 6; ++k) {
      const double moved = (x[k] - from[k]) * scale_;
      box.lo[k] = std::min(box.lo[k], moved);
      box.hi[k] = std::max(box.hi[k], moved);
    }
  }
  // After an overflow the box is unbounded, so that no comparison sees a NaN.
  for (int k = 0; k < 6; ++k) {
    if (box.hi[k] - box.lo[k] < HUGE_VAL) continue;
    box.lo[k] = -HUGE_VAL;
    box.hi[k] = HUGE_VAL;
  }
  boxes_[leaves_[leaf]] = box;
}

std::size_t RelativeMotionBounds::bytes() const {
  std::size_t owners = 0;
  for (const std::vector<std::uint32_t>& owner : owner_) owners += owner.capacity();
  return from_.capacity() * sizeof(VertexRecord) + boxes_.capacity() * sizeof(Box) +
         (leaves_.capacity() + first_.capacity() + owners) * sizeof(std::uint32_t) +
         vertices_.capacity() * sizeof(std::int32_t);
}

}  // namespace lazyccd
