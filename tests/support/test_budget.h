// How much of a test is run. Sanitizers make a run ten times as slow, and what they look for shows
// in one of many runs alike: there one value stands for all, and a tenth for what is random.
#pragma once

#include <cstdint>
#include <initializer_list>

#include "support/catch.h"

namespace lazyccd::test {

#if defined(LAZYCCD_SANITIZED)
inline constexpr bool is_sanitized = true;
#else
inline constexpr bool is_sanitized = false;
#endif

// For GENERATE: all of these values, or the last.
template <class T>
auto sweep(std::initializer_list<T> values) {
  const auto first = is_sanitized ? values.end() - 1 : values.begin();
  return Catch::Generators::from_range(first, values.end());
}

constexpr std::uint64_t repetitions(std::uint64_t count) {
  return is_sanitized ? (count + 9) / 10 : count;
}

}  // namespace lazyccd::test
