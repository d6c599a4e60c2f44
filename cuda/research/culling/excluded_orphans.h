// Orphan sets on the CPU: the traversal's candidates leave them out, and each is tested once.
#pragma once

#include <cstddef>
#include <vector>

#include "cpu/narrow/excluded_pairs.h"
#include "research/culling/orphan_sets.h"

namespace lazyccd::research {

class ExcludedOrphans : public ExcludedPairs {
 public:
  void set_mesh(const Mesh& mesh) override;
  int remove_from(ContactKind kind, Candidate* items, int count) const override;
  void push_to(Span<NarrowPhase* const> workers, const std::vector<VertexRecord>& vertices,
               ThreadPool& pool, Stats& stats) const override;
  std::size_t bytes() const override { return orphans_.bytes(); }

 private:
  const Mesh* mesh_ = nullptr;
  OrphanSets orphans_;
};

}  // namespace lazyccd::research
