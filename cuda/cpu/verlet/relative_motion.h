// Bounds of the relative motion of groups of primitives. Two groups that move together never come
// nearer to each other, no matter how far they move.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/bvh/node_pair.h"
#include "cpu/verlet/leaf_map.h"
#include "host/bvh/tree.h"
#include "host/scene/vertex_record.h"
#include "host/threads/thread_pool.h"

namespace lazyccd {

/// For each node of a tree, bounds of the displacements of all vertices below it, from one motion
/// to another: at its start and at its end.
class RelativeMotionBounds {
 public:
  /// Computes the bounds. `from` and `to`: the two motions, by vertex. Displacements are scaled by
  /// `scale`.
  void measure(const std::vector<VertexRecord>& from, const std::vector<VertexRecord>& to,
               double scale, const LeafMap& leaves, const Tree& tree, ThreadPool& pool);
  /// The same for the starts of the two motions only.
  void measure_starts(const std::vector<VertexRecord>& from, const std::vector<VertexRecord>& to,
                      double scale, const LeafMap& leaves, const Tree& tree, ThreadPool& pool);

  /// Upper bound of |displacement of p - displacement of q|^2, scaled, at start and end. p is any
  /// point below node a, and q any point below node b. Not less than the bound for nodes below
  /// these two. Infinite if the numbers overflow.
  double difference_squared(NodePair nodes) const {
    const Box &x = boxes_[nodes.a], &y = boxes_[nodes.b];
    double squared[2] = {0, 0};  // at start and end
    for (int k = 0; k < 6; ++k) {
      const double most = std::max(x.hi[k] - y.lo[k], y.hi[k] - x.lo[k]);
      squared[k / 3] += most * most;
    }
    return std::max(squared[0], squared[1]);
  }

  std::size_t bytes() const { return boxes_.capacity() * sizeof(Box); }

 private:
  struct Box {
    double lo[6], hi[6];  // displacements: x y z at the start, x y z at the end
  };

  // displacement(v, k): component k of the displacement of vertex v.
  template <class Displacement>
  void measure_all(const Displacement& displacement, const LeafMap& leaves, const Tree& tree,
                   ThreadPool& pool);

  std::vector<Box> boxes_;  // by node
};

}  // namespace lazyccd
