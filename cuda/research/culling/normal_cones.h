// Continuous normal cones of the nodes of a tree, with the contour condition
// (research/culling/normal_cone.h). They find parts of a surface that cannot touch themselves
// during the step. The traversal skips these.
#pragma once

#include <cstdint>
#include <vector>

#include "host/bvh/groups.h"
#include "host/bvh/tree.h"
#include "host/scene/mesh.h"
#include "host/threads/thread_pool.h"
#include "research/culling/flat_patches.h"
#include "research/culling/normal_cone.h"

namespace lazyccd::research {

/// The normal cones of all nodes.
class NormalCones {
 public:
  /// Prepares for a new tree.
  void build(const Mesh& mesh, const Groups& groups, const Tree& tree) {
    patches_.build(mesh, groups, tree);
  }
  /// Computes the cones of all nodes for new positions.
  void refit(const Mesh& mesh, const Tree& tree, const std::vector<VertexRecord>& vertices,
             ThreadPool& pool);

  /// Whether the faces below the node certainly do not touch each other during the step.
  bool apart_from_itself(std::uint32_t node, const std::vector<VertexRecord>& vertices) const;

  std::size_t bytes() const;

 private:
  Patches patches_;
  std::vector<Directions> face_cones_;  // in the order of the patches' faces
  std::vector<Directions> cones_;       // by node
};

}  // namespace lazyccd::research
