// Assertions: what the code believes where one folder hands data to another. A build with the CMake
// option LAZYCCD_ASSERTIONS checks them; any other build compiles them and evaluates nothing. They
// report mistakes of the code: wrong input of an application throws lazyccd::Error.
#pragma once

#include "lazyccd/export.h"

namespace lazyccd {

/// An assertion that failed. The texts live as long as the program.
struct FailedAssertion {
  const char* belief;     ///< what the code believed, in words
  const char* condition;  ///< the condition that is false, as it is written
  const char* file;
  int line;
};

/// Is called where an assertion fails, on any thread, perhaps on several at once. The process
/// aborts after it returns false, and also if it throws. It goes on after true: a test that counts.
using AssertHandler = bool (*)(const FailedAssertion&);

/// Installs a handler and returns the one before it. Null, the default, prints place and text to
/// stderr and aborts.
LAZYCCD_API AssertHandler set_assert_handler(AssertHandler handler);

/// What LAZYCCD_ASSERT calls if its condition is false. It throws nothing, so no step that catches
/// exceptions goes on without it.
LAZYCCD_API void assertion_failed(const FailedAssertion& failed) noexcept;

/// Whether this build checks assertions. For what is kept for them alone.
#if defined(LAZYCCD_ASSERTIONS)
constexpr bool checks_assertions = true;
#else
constexpr bool checks_assertions = false;
#endif

}  // namespace lazyccd

/// Checks a condition that must hold. Code for devices checks nothing.
#if defined(LAZYCCD_ASSERTIONS) && !defined(__CUDA_ARCH__)
#define LAZYCCD_ASSERT(condition, belief) \
  ((condition) ? static_cast<void>(0)     \
               : ::lazyccd::assertion_failed({belief, #condition, __FILE__, __LINE__}))
#else
#define LAZYCCD_ASSERT(condition, belief) static_cast<void>(false && (condition))
#endif
