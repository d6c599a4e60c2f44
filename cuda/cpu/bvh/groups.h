// The groups, which are the leaves of the hierarchy, and their boxes.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/bvh/group.h"
#include "cpu/kernels/leaf_kernels.h"
#include "cpu/scene/mesh.h"
#include "cpu/scene/vertex_record.h"
#include "cpu/threads/thread_pool.h"

namespace lazyccd {

/// Builds the groups of a mesh and refits their boxes.
class Groups {
 public:
  /// The boxes are wider than the primitives by `margin` (unscaled) on every side.
  explicit Groups(double margin = 0, const LeafKernels& kernels = *best_leaf_kernels())
      : margin_(margin), kernels_(&kernels) {}

  /// Builds the groups and refits their boxes. The cells (faces, then free edges) of each body are
  /// sorted in Morton order of their centroids at the start and cut into runs of kGroupCells. A
  /// vertex or edge belongs to the first group that contains it.
  void build(const Mesh& mesh, const std::vector<VertexRecord>& vertices, ThreadPool& pool,
             double scale = 1);

  /// Computes the boxes of all primitives and groups for new positions. The boxes hold positions
  /// times `scale`, a power of two. Without a scale, a very small scene would underflow in float,
  /// and all its boxes would overlap.
  void refit(const std::vector<VertexRecord>& vertices, ThreadPool& pool, double scale = 1);

  const std::vector<Group>& groups() const { return groups_; }
  const std::vector<Block>& blocks() const { return blocks_; }
  const std::vector<MotionBox>& boxes() const { return boxes_; }
  void set_margin(double margin) { margin_ = margin; }
  std::size_t bytes() const;

 private:
  double margin_;
  const LeafKernels* kernels_;
  std::vector<Group> groups_;
  std::vector<Block> blocks_;
  std::vector<MotionBox> boxes_;
  std::vector<VertexBox> vertex_boxes_;
};

}  // namespace lazyccd
