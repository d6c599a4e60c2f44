// How differently groups of primitives have moved: two that fly together never come nearer each
// other, however far.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "cpu/bvh/groups.h"
#include "cpu/scene/mesh.h"
#include "cpu/threads/thread_pool.h"
#include "cpu/bvh/tree.h"

namespace lazyccd {

class RelativeMotionBounds {
 public:
  // For the groups at the leaves of a tree.
  void build(const Mesh& mesh, const Groups& groups, const Tree& tree);

  // Motion is from where this step begins, times `scale`.
  void begin(const std::vector<VertexRecord>& records, double scale);
  // Motion up to either end of this step.
  void measure(const std::vector<VertexRecord>& records, const Tree& tree, ThreadPool& pool);

  // What any two points of what is below two nodes have moved differently, at most, squared: not
  // less than that of nodes below them, and infinite where numbers do not reach.
  double difference_squared(std::uint32_t a, std::uint32_t b) const {
    const Box &x = boxes_[a], &y = boxes_[b];
    double squared[2] = {0, 0};  // by end of the step
    for (int k = 0; k < 6; ++k) {
      const double most = std::max(x.hi[k] - y.lo[k], y.hi[k] - x.lo[k]);
      squared[k / 3] += most * most;
    }
    return std::max(squared[0], squared[1]);
  }

  // The leaf of the group that owns a primitive.
  std::uint32_t leaf_of(PrimitiveKind kind, std::int32_t id) const { return owner_[kind][id]; }
  double scale() const { return scale_; }
  std::size_t bytes() const;

 private:
  struct Box {
    double lo[6], hi[6];  // of each end of the step
  };

  void measure_leaf(std::uint32_t leaf, const std::vector<VertexRecord>& records);

  double scale_ = 1;
  std::vector<VertexRecord> from_;  // where motion is from, twice
  std::vector<Box> boxes_;          // of the motion, by node
  // The vertices of all primitives of each leaf, from first_[leaf] on.
  std::vector<std::uint32_t> leaves_, first_;
  std::vector<std::int32_t> vertices_;
  std::vector<std::uint32_t> owner_[3];  // by PrimitiveKind
};

}  // namespace lazyccd
