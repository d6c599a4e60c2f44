// Building the groups and refitting their boxes.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/group.h"
#include "cpu/narrow/leaf_kernels.h"
#include "cpu/scene/mesh.h"
#include "cpu/threads/thread_pool.h"

namespace lazyccd {

// A vertex over the step: start x y z, end x y z, two unused; one cache line.
struct alignas(64) VertexRecord {
  double x[8];
};

class Groups {
 public:
  // Boxes reach by `margin` beyond the primitives.
  explicit Groups(double margin = 0, const LeafKernels& kernels = *best_leaf_kernels())
      : margin_(margin), kernels_(&kernels) {}

  // Cells (faces, then free edges) of each body in Morton order of their centroids at the start, cut
  // into runs of kGroupCells. A vertex or edge belongs to the first group that has it.
  void build(const Mesh& mesh, const std::vector<VertexRecord>& vertices, ThreadPool& pool,
             double scale = 1);

  // Boxes of all primitives and groups for new positions. They are those of the scene times `scale`, a
  // power of two: in its own unit a very small one is a point to float, and all of it overlaps.
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
