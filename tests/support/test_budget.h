// Reduces the amount of testing in sanitizer builds. Sanitizers make a run ten times as slow, and
// similar runs show the same errors to them. So one value replaces a list of values, and random
// tests run a tenth of their repetitions.
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

/// For GENERATE: all values, or only the last one in sanitizer builds.
template <class T>
auto sweep(std::initializer_list<T> values) {
  const auto first = is_sanitized ? values.end() - 1 : values.begin();
  return Catch::Generators::from_range(first, values.end());
}

/// `count`, or a tenth of it, rounded up, in sanitizer builds.
constexpr std::uint64_t repetitions(std::uint64_t count) {
  return is_sanitized ? (count + 9) / 10 : count;
}

}  // namespace lazyccd::test
