// Bullet's elementary vertex-face test (btSoftBodyInternals.h, bernsteinCCD as CollideCCD calls it),
// one query at a time. Compiled once in each of Bullet's precisions, as bullet_ccd.h.
#pragma once

#include <cstdint>
#include <vector>

#include "lazyccd/query.h"
#include "lazyccd/span.h"

namespace lazyccd::bench {

struct BulletAnswers {
  double nanoseconds = 0;          // in the test itself, all queries; filling Bullet's structures is not counted
  std::vector<std::uint8_t> hits;  // one a query, 0 or 1
};

BulletAnswers bullet_queries(Span<const QueryPoints> queries);

}  // namespace lazyccd::bench
