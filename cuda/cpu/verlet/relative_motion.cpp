#include "cpu/verlet/relative_motion.h"

#include <algorithm>
#include <cmath>

namespace lazyccd {

template <class Displacement>
void RelativeMotionBounds::measure_all(const Displacement& displacement, const LeafMap& leaves,
                                       const Tree& tree, ThreadPool& pool) {
  const NoinitVector<TreeNode>& nodes = tree.nodes();
  boxes_.resize(nodes.size());
  pool.parallel_for(leaves.leaf_count(), 128, [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i) {
      Box box;
      std::fill_n(box.lo, 6, HUGE_VAL);
      std::fill_n(box.hi, 6, -HUGE_VAL);
      for (const std::int32_t v : leaves.vertices_of(i)) {
        for (int k = 0; k < 6; ++k) {
          const double moved = displacement(v, k);
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
      boxes_[leaves.node_of(i)] = box;
    }
  });
  tree.for_each_upward(pool, [&](std::size_t i) {
    if (nodes[i].leaf()) return;
    const Box &left = boxes_[nodes[i].left], &right = boxes_[nodes[i].right()];
    for (int k = 0; k < 6; ++k) {
      boxes_[i].lo[k] = std::min(left.lo[k], right.lo[k]);
      boxes_[i].hi[k] = std::max(left.hi[k], right.hi[k]);
    }
  });
}

void RelativeMotionBounds::measure(const std::vector<VertexRecord>& from,
                                   const std::vector<VertexRecord>& to, double scale,
                                   const LeafMap& leaves, const Tree& tree, ThreadPool& pool) {
  measure_all([&](std::int32_t v, int k) { return (to[v].x[k] - from[v].x[k]) * scale; }, leaves,
              tree, pool);
}

void RelativeMotionBounds::measure_starts(const std::vector<VertexRecord>& from,
                                          const std::vector<VertexRecord>& to, double scale,
                                          const LeafMap& leaves, const Tree& tree,
                                          ThreadPool& pool) {
  measure_all(
      [&](std::int32_t v, int k) { return k < 3 ? (to[v].x[k] - from[v].x[k]) * scale : 0; },
      leaves, tree, pool);
}

}  // namespace lazyccd
