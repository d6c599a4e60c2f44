// The groups, which are the leaves of the hierarchy, and their boxes.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/bvh/group.h"
#include "host/bvh/cell_order.h"
#include "host/kernels/leaf_kernels.h"
#include "host/scene/mesh.h"
#include "host/scene/vertex_record.h"
#include "host/threads/noinit_vector.h"
#include "host/threads/shared_array.h"
#include "host/threads/thread_pool.h"

namespace lazyccd {

/// Builds the groups of a mesh and refits their boxes.
class Groups {
 public:
  /// The boxes are wider than the primitives by `margin` (unscaled) on every side.
  explicit Groups(double margin = 0, const LeafKernels& kernels = *best_leaf_kernels())
      : margin_(margin), kernels_(&kernels) {}

  /// Builds the groups and refits their boxes. The cells (faces, then free edges) of each body are
  /// sorted in Morton order of their centroids at the start and cut into runs of kGroupCells. A
  /// vertex or edge belongs to the first cell that contains it, and so to one group; those that the
  /// mesh leaves out belong to none. The result does not depend on the number of threads.
  void build(const Mesh& mesh, const std::vector<VertexRecord>& vertices, ThreadPool& pool,
             double scale = 1);

  /// Computes the boxes of all primitives and groups for new positions. The boxes hold positions
  /// times `scale`, a power of two. Without a scale, a very small scene would underflow in float,
  /// and all its boxes would overlap.
  void refit(const std::vector<VertexRecord>& vertices, ThreadPool& pool, double scale = 1);

  const NoinitVector<Group>& groups() const { return groups_; }
  const NoinitVector<Block>& blocks() const { return blocks_; }
  const NoinitVector<MotionBox>& boxes() const { return boxes_; }
  /// By group: the Morton code of the centre of its vertices' box at the start.
  const NoinitVector<std::uint64_t>& codes() const { return codes_; }
  /// By group: its world, ascending; empty if all bodies are in one world.
  Span<const std::int32_t> worlds() const { return {worlds_.data(), worlds_.size()}; }
  void set_margin(double margin) { margin_ = margin; }
  std::size_t bytes() const;

 private:
  // Finds the first cell of every vertex and edge, which owns it.
  void claim_primitives(const Mesh& mesh, ThreadPool& pool);
  // Counts what each group owns, places its blocks, and finds its code.
  void count_primitives(const Mesh& mesh, const std::vector<VertexRecord>& vertices,
                        ThreadPool& pool);
  // Fills the blocks of groups [first, last), all but the boxes.
  void fill_blocks(const Mesh& mesh, std::size_t first, std::size_t last);
  void fill_group(const Mesh& mesh, const CellSegment& segment, std::size_t group);
  // Computes the boxes of the vertices.
  void box_vertices(const std::vector<VertexRecord>& vertices, ThreadPool& pool, double scale);

  double margin_;
  const LeafKernels* kernels_;
  CellOrder order_;
  SharedArray first_cell_[2];          // of vertices and edges, by PrimitiveKind: a place in order_
  NoinitVector<OwnedContents> owned_;  // by place in order_
  NoinitVector<Group> groups_;
  NoinitVector<std::uint64_t> codes_;
  NoinitVector<std::int32_t> worlds_;
  NoinitVector<Block> blocks_;
  NoinitVector<MotionBox> boxes_;
  NoinitVector<VertexBox> vertex_boxes_;
};

/// Calls f(vertex) for the vertices of all primitives of a group. A vertex of several primitives
/// comes more than once.
template <class F>
void for_each_vertex(const Groups& groups, const Group& group, F&& f) {
  const int kind = group.count[kFaces] != 0 ? kFaces : kEdges;
  const Block* block = groups.blocks().data() + group.first[kind];
  for (int i = 0; i < group.count[kind]; ++i)
    for (int k = 0; k <= kind; ++k) f(block[i / kBlockLanes].vertex[k][i % kBlockLanes]);
}

}  // namespace lazyccd
