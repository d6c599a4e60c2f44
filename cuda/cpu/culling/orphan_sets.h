// Orphan sets (Tang et al. 2009; the dissertation's Algorithms 2.2 and 2.3): elementary pairs that
// only adjacent faces have. A traversal that looks at no pair of adjacent faces misses exactly
// these, and tests them from this list instead, which depends on the topology alone.
//
// The refinement is to list a pair only where all pairs of faces that have it are adjacent: any
// other finds it by itself.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/contact_math.h"
#include "core/orphan_list.h"
#include "cpu/scene/mesh.h"

namespace lazyccd {

class OrphanSets {
 public:
  OrphanSets() = default;
  explicit OrphanSets(const Mesh& mesh);

  OrphanList of(ContactKind kind) const {
    const Orphans& orphans = orphans_[static_cast<int>(kind)];
    return {orphans.pairs.data(), orphans.first.data(),
            static_cast<std::uint32_t>(orphans.pairs.size())};
  }
  // Pairs of adjacent faces, and the elementary pairs that those have: what the refinement chose
  // from.
  std::int64_t adjacent_faces() const { return adjacent_faces_; }
  std::int64_t before_refinement() const { return before_refinement_; }
  std::size_t bytes() const;

 private:
  struct Orphans {
    std::vector<Candidate> pairs;
    std::vector<std::uint32_t> first;

    // Sorts the pairs of `primitives` primitives a, each once.
    void finish(std::size_t primitives);
  };

  Orphans orphans_[2];  // by ContactKind
  std::int64_t adjacent_faces_ = 0, before_refinement_ = 0;
};

}  // namespace lazyccd
