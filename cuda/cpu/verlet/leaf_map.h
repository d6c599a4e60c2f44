// Which vertices lie below each leaf of a tree, and which leaf owns each primitive.
#pragma once

#include <cstdint>
#include <vector>

#include "core/bvh/node_pair.h"
#include "core/narrow/contact_math.h"
#include "host/bvh/groups.h"
#include "host/bvh/tree.h"
#include "host/scene/mesh.h"
#include "host/threads/thread_pool.h"
#include "lazyccd/span.h"

namespace lazyccd {

class LeafMap {
 public:
  /// Sets the tree and the groups at its leaves.
  void build(const Mesh& mesh, const Groups& groups, const Tree& tree, ThreadPool& pool);

  std::size_t leaf_count() const { return leaves_.size(); }
  /// Node index of a leaf.
  std::uint32_t node_of(std::size_t leaf) const { return leaves_[leaf]; }
  /// The vertices of all primitives of a leaf, each once.
  Span<const std::int32_t> vertices_of(std::size_t leaf) const {
    return {vertices_.data() + first_[leaf], first_[leaf + 1] - first_[leaf]};
  }
  /// Node index of the leaf whose group owns the primitive.
  std::uint32_t owner_of(PrimitiveKind kind, std::int32_t id) const { return owner_[kind][id]; }
  /// The leaves that own the two primitives of a candidate, the smaller index first.
  NodePair owners_of(ContactKind kind, Candidate candidate) const;
  std::size_t bytes() const;

 private:
  // The vertices of leaf i are in vertices_, from first_[i] up to first_[i + 1].
  std::vector<std::uint32_t> leaves_, first_;
  std::vector<std::int32_t> vertices_;
  std::vector<std::uint32_t> owner_[3];  // by PrimitiveKind
};

}  // namespace lazyccd
