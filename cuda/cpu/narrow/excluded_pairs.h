// Interface to elementary pairs that are tested apart from the traversal. Its candidates leave them
// out.
#pragma once

#include <cstddef>
#include <vector>

#include "core/narrow/contact_math.h"
#include "host/scene/mesh.h"
#include "host/scene/vertex_record.h"
#include "host/threads/thread_pool.h"
#include "lazyccd/contact.h"
#include "lazyccd/span.h"
#include "lazyccd/stats.h"

namespace lazyccd {

class NarrowPhase;

/// The excluded pairs of a mesh.
class ExcludedPairs {
 public:
  virtual ~ExcludedPairs() = default;
  /// Sets another mesh. It must stay valid until the next call.
  virtual void set_mesh(const Mesh& mesh) = 0;
  /// Removes excluded pairs from `count` candidates. Returns how many are left.
  virtual int remove_from(ContactKind kind, Candidate* items, int count) const = 0;
  /// Gives the excluded pairs that may touch in this step to the workers, one for each thread of
  /// the pool, and counts them in the stats.
  virtual void push_to(Span<NarrowPhase* const> workers, const std::vector<VertexRecord>& vertices,
                       ThreadPool& pool, Stats& stats) const = 0;
  virtual std::size_t bytes() const = 0;
};

}  // namespace lazyccd
