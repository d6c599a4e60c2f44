// The caller's positions, checked and laid out for the backends.
#pragma once

#include <vector>

#include "cpu/bvh/groups.h"
#include "cpu/scene/mesh.h"
#include "cpu/threads/thread_pool.h"
#include "lazyccd/scene.h"

namespace lazyccd {

// Throws Error (size_mismatch) unless both ends have a position for every vertex.
void check_counts(const Mesh& mesh, const Positions& start, const Positions& end);

// Throws Error (non_finite_position) naming the first vertex that has one, and its body.
void check_finite(const Mesh& mesh, const Positions& start, const Positions& end);

// Fills the records; throws as both of the above. Returns the largest side of the box that bounds all
// positions at both ends.
double load_records(const Mesh& mesh, const Positions& start, const Positions& end, ThreadPool& pool,
                    std::vector<VertexRecord>& records);

}  // namespace lazyccd
