// Bounds of the relative motion of groups of primitives. Two groups that move together never come
// nearer to each other, no matter how far they move.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "cpu/bvh/groups.h"
#include "cpu/bvh/tree.h"
#include "cpu/scene/mesh.h"
#include "cpu/threads/thread_pool.h"

namespace lazyccd {

/// For each node of a tree, bounds of the displacement of all vertices below it since an origin
/// step.
class RelativeMotionBounds {
 public:
  /// Prepares for a new tree and the groups at its leaves.
  void build(const Mesh& mesh, const Groups& groups, const Tree& tree, ThreadPool& pool);

  /// Takes the start of this step as the origin of the motion. Displacements are scaled by `scale`.
  void begin(const std::vector<VertexRecord>& records, double scale);
  /// Computes the bounds of the motion from the origin to the start and to the end of this step.
  void measure(const std::vector<VertexRecord>& records, const Tree& tree, ThreadPool& pool);

  /// Upper bound of |displacement of p - displacement of q|^2, scaled, at both ends of the step. p
  /// is any point below node a, and q any point below node b. Not less than the bound for nodes
  /// below these two. Infinite if the numbers overflow.
  double difference_squared(std::uint32_t a, std::uint32_t b) const {
    const Box &x = boxes_[a], &y = boxes_[b];
    double squared[2] = {0, 0};  // by end of the step
    for (int k = 0; k < 6; ++k) {
      const double most = std::max(x.hi[k] - y.lo[k], y.hi[k] - x.lo[k]);
      squared[k / 3] += most * most;
    }
    return std::max(squared[0], squared[1]);
  }

  /// Node index of the leaf whose group owns the primitive.
  std::uint32_t leaf_of(PrimitiveKind kind, std::int32_t id) const { return owner_[kind][id]; }
  double scale() const { return scale_; }
  std::size_t bytes() const;

 private:
  struct Box {
    double lo[6], hi[6];  // displacements: x y z at the start of the step, x y z at its end
  };

  void measure_leaf(std::uint32_t leaf, const std::vector<VertexRecord>& records);

  double scale_ = 1;
  std::vector<VertexRecord> from_;  // origin of the motion: each position twice
  std::vector<Box> boxes_;          // bounds of the displacements, by node
  // Leaf i is node leaves_[i]. Its vertices are in vertices_, from first_[i] up to first_[i + 1].
  std::vector<std::uint32_t> leaves_, first_;
  std::vector<std::int32_t> vertices_;
  std::vector<std::uint32_t> owner_[3];  // by PrimitiveKind: node of the owner's leaf
};

}  // namespace lazyccd
