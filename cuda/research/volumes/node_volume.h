// Interface to bounding volumes of the tree nodes, in addition to their boxes. They are tested for
// pairs of nodes whose boxes overlap. There is one class for each kind of volume.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "host/bvh/groups.h"
#include "host/bvh/tree.h"
#include "host/threads/thread_pool.h"
#include "lazyccd/detector.h"

namespace lazyccd::research {

/// The volumes of all nodes of a tree.
class NodeVolume {
 public:
  virtual ~NodeVolume() = default;
  /// Computes the volumes for a new tree or new positions. Each volume bounds everything below its
  /// node during the whole step.
  virtual void refit(const Groups& groups, const Tree& tree,
                     const std::vector<VertexRecord>& vertices, ThreadPool& pool) = 0;
  /// Whether the volumes of two nodes certainly do not touch.
  virtual bool apart(std::uint32_t a, std::uint32_t b) const = 0;
  virtual std::size_t bytes() const = 0;
};

/// Makes the volumes of one kind. They are wider than the primitives by `margin` on every side.
/// Returns null for Volume::box, because the tree has the boxes.
std::unique_ptr<NodeVolume> make_node_volume(Volume volume, double margin);

}  // namespace lazyccd::research
