// The edges of a mesh, found from its faces.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "host/threads/noinit_vector.h"
#include "host/threads/thread_pool.h"
#include "lazyccd/scene.h"
#include "lazyccd/span.h"

namespace lazyccd {

/// All edges, and what they have to do with the faces.
class EdgeTable {
 public:
  /// Finds the sides of the faces and adds `more` edges. The indices must be valid. `pinned`: by
  /// vertex; empty: none.
  void build(std::size_t vertex_count, Span<const Face> faces, Span<const Edge> more,
             Span<const char> pinned, ThreadPool& pool);

  /// Each as (smaller, larger) vertex index; sorted by the larger index, then the smaller.
  NoinitVector<Edge> edges;
  NoinitVector<std::int32_t> free_edges;                 ///< edges that are no side of a face
  NoinitVector<std::array<std::int32_t, 3>> face_edges;  ///< by face: sides (0 1), (1 2), (2 0)
  NoinitVector<std::int32_t> first_faces;  ///< by edge: its first face that is not pinned, or -1
  bool has_duplicate_faces = false;        ///< two faces have the same vertices
};

}  // namespace lazyccd
