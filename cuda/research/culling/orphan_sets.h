// Orphan sets (Tang et al. 2009; da Silva, Algorithms 2.2 and 2.3): elementary pairs that only
// adjacent faces have. A traversal that skips all pairs of adjacent faces misses exactly these.
// They are tested from this list instead, which depends only on the topology.
//
// Refinement: a pair is listed only if all pairs of faces that have it are adjacent. Otherwise the
// traversal finds it at a pair of faces that are not adjacent.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/narrow/contact_math.h"
#include "host/scene/mesh.h"
#include "research/culling/orphan_list.h"

namespace lazyccd::research {

/// The orphan sets of a mesh.
class OrphanSets {
 public:
  OrphanSets() = default;
  explicit OrphanSets(const Mesh& mesh);

  OrphanList of(ContactKind kind) const {
    const Orphans& orphans = orphans_[static_cast<int>(kind)];
    return {orphans.pairs.data(), orphans.first.data(),
            static_cast<std::uint32_t>(orphans.pairs.size())};
  }
  /// Number of pairs of adjacent faces, and number of their elementary pairs before the refinement.
  std::int64_t adjacent_faces() const { return adjacent_faces_; }
  std::int64_t before_refinement() const { return before_refinement_; }
  std::size_t bytes() const;

 private:
  struct Orphans {
    std::vector<Candidate> pairs;      // sorted
    std::vector<std::uint32_t> first;  // index of the first pair of each primitive a, and the end

    // Sorts the pairs, removes duplicates, and fills `first` for `primitives` primitives a.
    void finish(std::size_t primitives);
  };

  Orphans orphans_[2];  // by ContactKind
  std::int64_t adjacent_faces_ = 0, before_refinement_ = 0;
};

}  // namespace lazyccd::research
