// A bounding volume of every tree node, beside the box that it has anyway: a second look at the
// pairs whose boxes overlap. One class a kind of volume.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "cpu/bvh/groups.h"
#include "cpu/threads/thread_pool.h"
#include "cpu/bvh/tree.h"
#include "lazyccd/detector.h"

namespace lazyccd {

class NodeVolume {
 public:
  virtual ~NodeVolume() = default;
  // For a new tree or new positions. Each volume holds what is below its node over the whole step.
  virtual void refit(const Groups& groups, const Tree& tree,
                     const std::vector<VertexRecord>& vertices, ThreadPool& pool) = 0;
  // Whether the volumes of two nodes certainly do not touch.
  virtual bool apart(std::uint32_t a, std::uint32_t b) const = 0;
  virtual std::size_t bytes() const = 0;
};

// Volumes reach by `margin` beyond the primitives. Null where the box is all there is.
std::unique_ptr<NodeVolume> make_node_volume(Volume volume, double margin);

// f(vertex) for the vertices of all primitives of a group, those of several more than once.
template <class F>
void for_each_vertex(const Groups& groups, const Group& group, F&& f) {
  const int kind = group.count[kFaces] != 0 ? kFaces : kEdges;
  const Block* block = groups.blocks().data() + group.first[kind];
  for (int i = 0; i < group.count[kind]; ++i)
    for (int k = 0; k <= kind; ++k) f(block[i / kBlockLanes].vertex[k][i % kBlockLanes]);
}

}  // namespace lazyccd
