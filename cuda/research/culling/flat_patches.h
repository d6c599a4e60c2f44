// The patches of a tree: nodes whose faces are one oriented piece of surface with one boundary
// loop. Continuous normal cones need this information about the topology.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "host/bvh/groups.h"
#include "host/bvh/tree.h"
#include "host/scene/mesh.h"
#include "lazyccd/span.h"

namespace lazyccd::research {

/// Faces and boundaries of the patches of a tree.
class Patches {
 public:
  // Largest patch, in groups. Larger ones are seldom flat, and the contour test is quadratic in the
  // length of the boundary.
  static constexpr std::int32_t kLargest = 32;

  void build(const Mesh& mesh, const Groups& groups, const Tree& tree);

  /// All faces, in the order of the leaves, and the index of the first face of a leaf.
  const std::vector<std::int32_t>& faces() const { return faces_; }
  std::uint32_t first_face(std::int32_t leaf) const { return first_face_[leaf]; }

  /// The boundary of a node: its vertices in order, as a part of vertices(). Empty if the node is
  /// no patch.
  struct Boundary {
    std::uint32_t first = 0, count = 0;
  };
  const std::vector<Boundary>& boundaries() const { return boundaries_; }  ///< by node
  const std::vector<std::int32_t>& vertices() const { return vertices_; }
  Span<const std::int32_t> boundary(std::uint32_t node) const {
    return {vertices_.data() + boundaries_[node].first, boundaries_[node].count};
  }

  std::size_t bytes() const {
    return (faces_.capacity() + vertices_.capacity()) * sizeof(std::int32_t) +
           first_face_.capacity() * sizeof(std::uint32_t) +
           boundaries_.capacity() * sizeof(Boundary);
  }

 private:
  std::vector<std::int32_t> faces_, vertices_;
  std::vector<std::uint32_t> first_face_;  // by leaf, then the number of faces
  std::vector<Boundary> boundaries_;
};

}  // namespace lazyccd::research
