// Generators of queries, regular and degenerate: every kind that is known to have broken a
// collision test. The queries have no answer; the oracle gives it (support/oracle.h).
#pragma once

#include <cstdint>
#include <vector>

#include "lazyccd/query.h"

namespace lazyccd::test {

/// SplitMix64 (Steele et al. 2014). The same numbers on every machine, unlike the distributions of
/// the standard library.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  std::uint64_t bits();
  int integer(int lo, int hi);  ///< lo <= result <= hi
  double uniform(double lo, double hi);
  bool chance(double probability) { return uniform(0, 1) < probability; }
  /// A multiple of 2^-10 in [-1, 1]. Sums and products of a few of them are exact.
  double coarse() { return integer(-1024, 1024) / 1024.0; }

 private:
  std::uint64_t state_;
};

/// One kind of query.
struct Generator {
  const char* name;
  const char* meaning;
  bool is_degenerate;  ///< some sign that decides the query is zero or nearly zero
  int share;           ///< relative number in a mixed run; small if the oracle is slow
  QueryPoints (*make)(ContactKind, Random&);
};

/// All generators.
const std::vector<Generator>& generators();

/// The query of this number. Depends on the arguments alone.
QueryPoints generate(const Generator& generator, ContactKind kind, std::uint64_t seed,
                     std::uint64_t number);

}  // namespace lazyccd::test
