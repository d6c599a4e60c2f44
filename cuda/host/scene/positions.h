// Checks the caller's positions and copies them into records for the backends.
#pragma once

#include <vector>

#include "host/scene/mesh.h"
#include "host/scene/vertex_record.h"
#include "host/threads/thread_pool.h"
#include "lazyccd/scene.h"

namespace lazyccd {

/// Throws Error(size_mismatch) unless both ends have a position for every vertex.
void check_counts(const Mesh& mesh, const Positions& start, const Positions& end);

/// Throws Error(non_finite_position) with the first vertex whose position is not finite, and its
/// body.
void check_finite(const Mesh& mesh, const Positions& start, const Positions& end);

/// Fills the records. Throws like the two functions above. Returns the largest side of the box
/// around all positions at both ends, in the unit of the positions.
double load_records(const Mesh& mesh, const Positions& start, const Positions& end,
                    ThreadPool& pool, std::vector<VertexRecord>& records);

}  // namespace lazyccd
