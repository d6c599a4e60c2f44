// Query sets that need no file: the tests' generators, the truth by the tests' exact oracle.
#pragma once

#include <cstdint>
#include <vector>

#include "bench/query_sets.h"

namespace lazyccd::bench {

// Two sets of each kind, `count` queries each: "generated" and "generated, degenerate".
std::vector<QuerySet> generated_query_sets(int count, std::uint64_t seed);

}  // namespace lazyccd::bench
