// The first assertion that fails in a piece of code, for tests of LAZYCCD_ASSERT.
#pragma once

#include <functional>
#include <string>

namespace lazyccd::test {

/// Runs the code in a process of its own, which ends at the first assertion that fails, so nothing
/// works on with what must not be. Returns what was believed; empty: all held. The code must start
/// the threads that it needs.
std::string failed_belief(const std::function<void()>& code);

/// Whether failed_belief() works: in builds with assertions, on systems that have fork().
#if defined(LAZYCCD_ASSERTIONS) && !defined(_WIN32)
constexpr bool finds_failed_beliefs = true;
#else
constexpr bool finds_failed_beliefs = false;
#endif

}  // namespace lazyccd::test
