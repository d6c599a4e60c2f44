// How work is shared among threads: a function, and not Threads, so that tests can pass their own.
#pragma once

#include <cstddef>
#include <functional>

#include "util/float_environment.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Runs body(first, last) over disjoint ranges of [0, count), each of at most `grain` elements, or
/// over all of it at once: Threads::parallel_for(). Ranges may begin anywhere.
using ParallelFor =
    std::function<void(std::size_t count, std::size_t grain,
                       const std::function<void(std::size_t first, std::size_t last)>& body)>;

/// Calls body(first, last) over disjoint ranges of [0, count), with the caller's floating-point
/// mode on every thread. On one thread there is one range.
template <class Body>
void for_ranges(const ParallelFor& parallel_for, std::size_t count, std::size_t grain,
                const Body& body) {
  if (count == 0) return;
  const FloatMode caller_mode;
  parallel_for(count, grain, [&](std::size_t first, std::size_t last) {
    const WithFloatMode mode(caller_mode);
    body(first, last);
  });
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
