// The nodes of a tree whose faces could be one patch of a surface that does not touch itself, with
// their boundaries: what continuous normal cones need to know of the topology.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "cpu/bvh/groups.h"
#include "cpu/scene/mesh.h"
#include "cpu/bvh/tree.h"
#include "lazyccd/span.h"

namespace lazyccd {

class Patches {
 public:
  // Larger ones are seldom flat, and the contour test is quadratic in the boundary.
  static constexpr std::int32_t kLargest = 32;  // groups

  void build(const Mesh& mesh, const Groups& groups, const Tree& tree);

  // All faces in the order of the leaves, and where those of a leaf start.
  const std::vector<std::int32_t>& faces() const { return faces_; }
  std::uint32_t first_face(std::int32_t leaf) const { return first_face_[leaf]; }

  // Of each node the vertices of its boundary in order, within vertices(); none where the node is
  // no patch.
  struct Boundary {
    std::uint32_t first = 0, count = 0;
  };
  const std::vector<Boundary>& boundaries() const { return boundaries_; }
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
  std::vector<std::uint32_t> first_face_;  // of each leaf, and the end
  std::vector<Boundary> boundaries_;
};

}  // namespace lazyccd
