// Runs Bullet's elementary vertex-face test: bernsteinCCD() of btSoftBodyInternals.h, as CollideCCD
// calls it, one query at a time. Compiled once in each of Bullet's precisions, like ccd.h.
#pragma once

#include <cstdint>
#include <vector>

#include "lazyccd/query.h"
#include "lazyccd/span.h"

namespace lazyccd::bench {

/// The answers to a set of queries.
struct BulletAnswers {
  double nanoseconds = 0;  // processor time of all queries, without filling Bullet's structures
  std::vector<std::uint8_t> hits;  // one a query, 0 or 1
};

/// Decides vertex-face queries.
BulletAnswers bullet_queries(Span<const QueryPoints> queries);

}  // namespace lazyccd::bench
