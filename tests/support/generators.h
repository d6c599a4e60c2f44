// Queries of every sort that has broken a collision test, regular and degenerate. They carry no
// answer: the truth is the oracle's (support/oracle.h).
#pragma once

#include <cstdint>
#include <vector>

#include "lazyccd/query.h"

namespace lazyccd::test {

// SplitMix64 (Steele et al. 2014). The same numbers on every machine, unlike std distributions.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  std::uint64_t bits();
  int integer(int lo, int hi);  // lo <= result <= hi
  double uniform(double lo, double hi);
  bool chance(double probability) { return uniform(0, 1) < probability; }
  // A multiple of 2^-10 in [-1, 1]: sums and products of a few of them are exact.
  double coarse() { return integer(-1024, 1024) / 1024.0; }

 private:
  std::uint64_t state_;
};

struct Generator {
  const char* name;
  const char* meaning;
  bool is_degenerate;  // built so that some sign that matters is zero, or all but
  int share;           // how many of a mixed run, relatively: few where the truth is slow to find
  QueryPoints (*make)(ContactKind, Random&);
};

const std::vector<Generator>& generators();

// The query of that number: a function of its arguments alone.
QueryPoints generate(const Generator& generator, ContactKind kind, std::uint64_t seed,
                     std::uint64_t number);

}  // namespace lazyccd::test
