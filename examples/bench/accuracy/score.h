// Measures speed and accuracy of methods on sets of queries.
#pragma once

#include <string>
#include <vector>

#include "bench/accuracy/query_sets.h"
#include "bench/peers/method.h"

namespace lazyccd::bench {

/// The result of one method on one set.
struct Score {
  std::string set, kind, method, precision;
  std::size_t queries = 0;
  std::size_t decided = 0;  // fewer than `queries` if the time was over; spread evenly over the set
  std::size_t truly_touching = 0, missed = 0, false_hits = 0;
  std::size_t late = 0;  // number of times of impact that are after the true one
  // True minus reported time of impact, of each hit for which both are known.
  std::vector<double> early = {};
  double nanoseconds = 0;  // per query: median over the rounds of the mean over the set
  bool gives_time = false;
  int rounds = 0;
};

/// Limits of a measurement.
struct Budget {
  int rounds = 5;
  double seconds = 2;  // for one method on one set, over all rounds; also stops the first round
};

/// Measures all methods on one set, on one thread. In each round the methods take turns, so that
/// other load of the machine affects all of them equally. The first round also compares the answers
/// with the truth.
std::vector<Score> measure(const QuerySet& set, const std::vector<peers::Method>& methods,
                           const Budget& budget);

/// Combines the scores of several sets: adds counts and weights times by the number of queries.
Score pooled(std::string name, std::string kind, const std::vector<const Score*>& parts);

}  // namespace lazyccd::bench
