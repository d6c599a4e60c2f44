#include "cpu/verlet/relative_motion.h"

#include <algorithm>
#include <cmath>

#include "cpu/bvh/node_volume.h"

namespace lazyccd {

namespace {

// The vertices of one group, each once.
class VertexSet {
 public:
  VertexSet() { std::fill_n(slots_, kSlots, -1); }
  // Returns whether the vertex is new.
  bool insert(std::int32_t v) {
    std::uint32_t at = static_cast<std::uint32_t>(v) * 0x9e3779b1u >> (32 - kBits);  // Knuth's hash
    while (slots_[at] >= 0 && slots_[at] != v) at = (at + 1) % kSlots;
    const bool is_new = slots_[at] < 0;
    slots_[at] = v;
    return is_new;
  }

 private:
  static constexpr int kBits = 7;
  static constexpr std::uint32_t kSlots = 1u << kBits;
  static_assert(kSlots >= 2 * 3 * kGroupCells, "half of the slots stay empty");
  std::int32_t slots_[kSlots];
};

}  // namespace

void RelativeMotionBounds::build(const Mesh& mesh, const Groups& groups, const Tree& tree,
                                 ThreadPool& pool) {
  const NoinitVector<TreeNode>& nodes = tree.nodes();
  boxes_.resize(nodes.size());
  owner_[kVertices].assign(mesh.vertex_count(), 0);
  owner_[kEdges].assign(mesh.edges().size(), 0);
  owner_[kFaces].assign(mesh.faces().size(), 0);
  leaves_.clear();
  for (std::uint32_t node = 0; node < nodes.size(); ++node)
    if (nodes[node].leaf()) leaves_.push_back(node);
  first_.resize(leaves_.size() + 1);
  first_[0] = 0;

  constexpr std::size_t part = 128;  // leaves; first_ counts from the beginning of their part
  std::vector<std::vector<std::int32_t>> vertices((leaves_.size() + part - 1) / part);
  pool.parallel_for(vertices.size(), 1, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t p = begin; p < end; ++p)
      for (std::size_t i = p * part; i < std::min((p + 1) * part, leaves_.size()); ++i) {
        const Group& group = groups.groups()[nodes[leaves_[i]].group()];
        for (int kind = 0; kind < 3; ++kind) {
          const Block* block = groups.blocks().data() + group.first[kind];
          for (int k = 0; k < group.count[kind]; ++k)
            owner_[kind][block[k / kBlockLanes].id[k % kBlockLanes]] = leaves_[i];
        }
        VertexSet seen;
        for_each_vertex(groups, group, [&](std::int32_t v) {
          if (seen.insert(v)) vertices[p].push_back(v);
        });
        first_[i + 1] = static_cast<std::uint32_t>(vertices[p].size());
      }
  });
  vertices_.clear();
  for (std::size_t p = 0; p < vertices.size(); ++p) {
    const auto before = static_cast<std::uint32_t>(vertices_.size());
    for (std::size_t i = p * part; i < std::min((p + 1) * part, leaves_.size()); ++i)
      first_[i + 1] += before;
    vertices_.insert(vertices_.end(), vertices[p].begin(), vertices[p].end());
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
    const Box &left = boxes_[nodes[i].left], &right = boxes_[nodes[i].right()];
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
