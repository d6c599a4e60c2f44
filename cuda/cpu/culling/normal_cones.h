// Continuous normal cones with the contour condition (core/normal_cone.h) of a tree's nodes: parts
// of a surface that cannot touch themselves during the step, so that the traversal need not open
// them.
#pragma once

#include <cstdint>
#include <vector>

#include "core/normal_cone.h"
#include "cpu/bvh/groups.h"
#include "cpu/scene/mesh.h"
#include "cpu/culling/flat_patches.h"
#include "cpu/threads/thread_pool.h"
#include "cpu/bvh/tree.h"

namespace lazyccd {

class NormalCones {
 public:
  // For a new tree.
  void build(const Mesh& mesh, const Groups& groups, const Tree& tree) {
    patches_.build(mesh, groups, tree);
  }
  // For new positions: the cones of all nodes.
  void refit(const Mesh& mesh, const Tree& tree, const std::vector<VertexRecord>& vertices,
             ThreadPool& pool);

  // Whether the faces below the node certainly do not touch each other in the step.
  bool apart_from_itself(std::uint32_t node, const std::vector<VertexRecord>& vertices) const;

  std::size_t bytes() const;

 private:
  Patches patches_;
  std::vector<Directions> face_cones_;  // in the order of the patches' faces
  std::vector<Directions> cones_;       // by node
};

}  // namespace lazyccd
