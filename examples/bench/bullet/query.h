// Bullet's elementary vertex-face test (btSoftBodyInternals.h, bernsteinCCD as CollideCCD calls
// it), one query at a time. Compiled once in each of Bullet's precisions, as bullet_ccd.h.
#pragma once

#include <cstdint>
#include <vector>

#include "lazyccd/query.h"
#include "lazyccd/span.h"

namespace lazyccd::bench {

struct BulletAnswers {
  double nanoseconds = 0;  // of processor time, all queries, without filling Bullet's structures
  std::vector<std::uint8_t> hits;  // one a query, 0 or 1
};

BulletAnswers bullet_queries(Span<const QueryPoints> queries);

}  // namespace lazyccd::bench
