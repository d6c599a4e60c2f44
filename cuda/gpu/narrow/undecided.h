// What double could not decide, on the host.
#pragma once

#include <cstddef>

#include "cpu/scene/mesh.h"
#include "cpu/threads/thread_pool.h"
#include "gpu/scene/scene.cuh"
#include "lazyccd/stats.h"

namespace lazyccd::gpu {

// Decides the queries exactly and merges the contacts among them into the `count` sorted ones,
// where there is room for all; counts them in the stats, the hash too. Returns how many there are
// now.
std::size_t merge_residue(const Mesh& mesh, const Positions& start, const Positions& end,
                          const HardQuery* queries, std::size_t query_count, ThreadPool& pool,
                          Contact* contacts, std::size_t count, Stats& stats);

}  // namespace lazyccd::gpu
