// A random number generator that gives the same numbers on every machine, unlike std distributions.
#pragma once

#include <cstdint>

namespace lazyccd::models {

/// SplitMix64 (Steele et al. 2014).
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  /// Returns a number in [lo, hi).
  double uniform(double lo, double hi) {
    state_ += 0x9e3779b97f4a7c15ull;
    std::uint64_t x = state_;
    x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9ull;
    x = (x ^ x >> 27) * 0x94d049bb133111ebull;
    x ^= x >> 31;
    return lo + (hi - lo) * static_cast<double>(x >> 11) * 0x1p-53;
  }

 private:
  std::uint64_t state_;
};

}  // namespace lazyccd::models
