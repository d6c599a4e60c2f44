// Interface to culling of nodes beyond their axis-aligned boxes. It is asked about pairs of nodes
// whose boxes overlap.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "host/bvh/groups.h"
#include "host/bvh/tree.h"
#include "host/scene/mesh.h"
#include "host/scene/vertex_record.h"
#include "host/threads/thread_pool.h"

namespace lazyccd {

/// Culling data of all nodes of a tree.
class NodeCulling {
 public:
  virtual ~NodeCulling() = default;
  /// Prepares for a new tree.
  virtual void build(const Mesh& mesh, const Groups& groups, const Tree& tree) = 0;
  /// Computes the data for new positions. It bounds everything below a node during the whole step.
  virtual void refit(const Mesh& mesh, const Groups& groups, const Tree& tree,
                     const std::vector<VertexRecord>& vertices, ThreadPool& pool) = 0;
  /// Whether two nodes certainly do not touch.
  virtual bool apart(std::uint32_t a, std::uint32_t b) const = 0;
  /// Whether the primitives below a node certainly do not touch each other. `vertices`: of refit().
  virtual bool apart_from_itself(std::uint32_t node,
                                 const std::vector<VertexRecord>& vertices) const = 0;
  virtual std::size_t bytes() const = 0;
};

}  // namespace lazyccd
