// Orphan sets (Tang et al. 2009; the dissertation's Algorithms 2.2 and 2.3): elementary pairs that
// only adjacent faces have. A traversal that looks at no pair of adjacent faces misses exactly
// these, and tests them from this list instead, which depends on the topology alone.
//
// The refinement is to list a pair only where all pairs of faces that have it are adjacent: any
// other finds it by itself.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <unordered_set>
#include <vector>

#include "core/contact_math.h"
#include "cpu/mesh.h"

namespace lazyccd {

class OrphanSets {
 public:
  OrphanSets() = default;
  explicit OrphanSets(const Mesh& mesh);

  const std::vector<Candidate>& of(ContactKind kind) const {
    return orphans_[static_cast<int>(kind)];
  }
  bool contains(ContactKind kind, Candidate pair) const {
    return keys_[static_cast<int>(kind)].count(key(kind, pair)) != 0;
  }
  // Pairs of adjacent faces, and the elementary pairs that those have: what the refinement chose
  // from.
  std::int64_t adjacent_faces() const { return adjacent_faces_; }
  std::int64_t before_refinement() const { return before_refinement_; }
  std::size_t bytes() const;

 private:
  static std::uint64_t key(ContactKind kind, Candidate c) {
    if (kind == ContactKind::edge_edge && c.b < c.a) c = {c.b, c.a};
    return std::uint64_t{static_cast<std::uint32_t>(c.a)} << 32 | static_cast<std::uint32_t>(c.b);
  }

  std::vector<Candidate> orphans_[2];  // by ContactKind
  std::unordered_set<std::uint64_t> keys_[2];
  std::int64_t adjacent_faces_ = 0, before_refinement_ = 0;
};

}  // namespace lazyccd
