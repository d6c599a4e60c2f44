// Exact decision, on the host, of the few queries that need integers of any size.
#pragma once

#include <cstddef>

#include "gpu/scene/scene.cuh"
#include "host/scene/mesh.h"
#include "host/threads/thread_pool.h"
#include "lazyccd/stats.h"

namespace lazyccd::gpu {

/// Decides the queries exactly and merges their contacts into the `count` sorted contacts. The
/// array must have room for all of them. Adds the new contacts and their hash to the stats. Returns
/// the new number of contacts.
std::size_t merge_undecided(const Mesh& mesh, const Positions& start, const Positions& end,
                            const HardQuery* queries, std::size_t query_count, ThreadPool& pool,
                            Contact* contacts, std::size_t count, Stats& stats);

}  // namespace lazyccd::gpu
