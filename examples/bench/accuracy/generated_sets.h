// Query sets that need no file. They come from the generators of the tests, with the truth from the
// exact oracle of the tests.
#pragma once

#include <cstdint>
#include <vector>

#include "bench/accuracy/query_sets.h"

namespace lazyccd::bench {

/// Returns two sets of each kind with `count` queries each: "generated" and "generated,
/// degenerate".
std::vector<QuerySet> generated_query_sets(int count, std::uint64_t seed);

}  // namespace lazyccd::bench
