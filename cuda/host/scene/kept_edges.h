// The edges of a topology that has many bodies of the last one: their edges are copied.
#pragma once

#include <cstddef>
#include <cstdint>

#include "host/scene/edge_table.h"
#include "host/threads/thread_pool.h"
#include "lazyccd/scene.h"
#include "lazyccd/span.h"

namespace lazyccd {

/// What the edges of a mesh depend on. Indices are valid.
struct EdgeInput {
  Span<const std::int32_t> body_of_vertex;
  std::size_t body_count = 0;
  Span<const Face> faces;
  Span<const Edge> more;    ///< Topology::edges
  Span<const char> pinned;  ///< by vertex; empty: none
};

/// Builds the table of `input`, the same as EdgeTable::build() does. Bodies that `last_input` has
/// too, whatever the numbers of their vertices and faces, take their edges from `last`, its table.
/// The cost then is that of the other bodies, and of copies. Returns false, and builds nothing, if
/// few faces are of such bodies, or the primitives are not in the order of their bodies.
bool build_with_kept_edges(const EdgeInput& input, const EdgeInput& last_input,
                           const EdgeTable& last, EdgeTable& table, ThreadPool& pool);

}  // namespace lazyccd
