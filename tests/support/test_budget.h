// Reduces the amount of testing in sanitizer builds and in quick runs.
//
// Sanitizers make a run several times as slow, and similar runs show the same errors to them. So
// one value replaces a list of values, and random tests run a tenth of their repetitions. In quick
// runs (environment variable LAZYCCD_QUICK_TESTS) random tests run a quarter of their repetitions.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <initializer_list>

#include "support/catch.h"

namespace lazyccd::test {

#if defined(LAZYCCD_SANITIZED)
inline constexpr bool is_sanitized = true;
#else
inline constexpr bool is_sanitized = false;
#endif

/// For GENERATE: all values, or only the last one in sanitizer builds.
template <class T>
auto sweep(std::initializer_list<T> values) {
  const auto first = is_sanitized ? values.end() - 1 : values.begin();
  return Catch::Generators::from_range(first, values.end());
}

/// `count`; a tenth of it, rounded up, in sanitizer builds; a quarter of it in quick runs.
inline std::uint64_t repetitions(std::uint64_t count) {
  static const bool is_quick = std::getenv("LAZYCCD_QUICK_TESTS") != nullptr;
  const std::uint64_t divisor = is_sanitized ? 10 : is_quick ? 4 : 1;
  return (count + divisor - 1) / divisor;
}

}  // namespace lazyccd::test
