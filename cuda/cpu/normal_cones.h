// Continuous normal cones with the contour condition: parts of a surface that cannot touch
// themselves during the step, so that the traversal need not open them (Volino and
// Magnenat-Thalmann 1994; Tang et al. 2008 for the continuous case). Decided by certified signs:
// what is culled has no contact.
//
// A patch is the faces below a tree node. Seen along a direction v, let all its faces have positive
// area at every time of the step, and let its boundary be one closed curve that never meets itself.
// Then the number of times that the patch covers a generic point of the plane is the winding number
// of the boundary there, 0 or 1: the view is one to one, and two points of the patch that coincide
// are the same point. The tests between primitives that share a vertex are none of the detector's.
//
// The cone of normals is kept as the set of those of 26 directions that lie in it: a few additions
// a face, one AND a node, and no angle is ever rounded.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "cpu/groups.h"
#include "cpu/mesh.h"
#include "cpu/thread_pool.h"
#include "cpu/tree.h"

namespace lazyccd {

// Directions of view: the axes and diagonals of a cube, up to sign, with two more whose coordinates
// span the plane seen.
struct View {
  std::array<int, 3> along, u, w;
};
constexpr int kViews = 13;
extern const std::array<View, kViews> kViewTable;

class NormalCones {
 public:
  // For a new tree: which nodes are patches that could be culled, and their boundaries.
  void build(const Mesh& mesh, const Groups& groups, const Tree& tree);
  // For new positions: the cones of all nodes.
  void refit(const Mesh& mesh, const Tree& tree, const std::vector<VertexRecord>& vertices,
             ThreadPool& pool);

  // Whether the faces below the node certainly do not touch each other in the step.
  bool apart_from_itself(std::uint32_t node, const std::vector<VertexRecord>& vertices) const;

  std::size_t bytes() const;

 private:
  // Sets of directions: bit i for view i, bit 16 + i for its opposite.
  using Directions = std::uint32_t;

  // The vertices of the boundary in order, within loops_; none: the node is not culled.
  struct Loop {
    std::uint32_t first = 0, count = 0;
  };

  std::vector<std::int32_t> faces_;        // in the order of the leaves
  std::vector<std::uint32_t> first_face_;  // of each leaf in that order, and the end
  std::vector<std::int32_t> loops_;
  std::vector<Loop> loop_of_;           // by node
  std::vector<Directions> face_cones_;  // by face of the mesh
  std::vector<Directions> cones_;       // by node
};

}  // namespace lazyccd
