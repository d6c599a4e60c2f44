// How fast and how right one method is on one set of queries.
#pragma once

#include <string>
#include <vector>

#include "bench/query_sets.h"
#include "bench/peers/method.h"

namespace lazyccd::bench {

struct Score {
  std::string set, kind, method, precision;
  std::size_t queries = 0;
  std::size_t decided = 0;  // fewer where the time allowed was over; spread evenly over the set
  std::size_t truly_touching = 0, missed = 0, false_hits = 0;
  std::size_t late = 0;  // times of impact after the true one
  std::vector<double> early =
      {};                  // true minus reported time of impact of each hit where both are known
  double nanoseconds = 0;  // per query: median over the rounds of the mean over the set
  bool gives_time = false;
  int rounds = 0;
};

struct Budget {
  int rounds = 5;
  double seconds = 2;  // for a method on a set, all rounds; the first round stops there, too
};

// All methods on one set: round by round, each method in turn, so that what else the machine does
// hits all alike. One thread. The first round also compares the answers with the truth.
std::vector<Score> measure(const QuerySet& set, const std::vector<peers::Method>& methods,
                           const Budget& budget);

// Several sets as one: counts added, times weighted by the number of queries.
Score pooled(std::string name, std::string kind, const std::vector<const Score*>& parts);

}  // namespace lazyccd::bench
