// How work is shared among threads: a function, and not Threads, so that tests can pass their own.
#pragma once

#include <cstddef>
#include <functional>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/threads.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Runs body(first, last) over disjoint ranges of [0, count), each of at most `grain` elements, or
/// over all of it at once, in the caller's floating-point mode: Threads::parallel_for(). Ranges may
/// begin anywhere.
using ParallelFor =
    std::function<void(std::size_t count, std::size_t grain,
                       FunctionRef<void(std::size_t first, std::size_t last)> body)>;

/// Calls body(first, last) over disjoint ranges of [0, count). On one thread there is one range.
template <class Body>
void for_ranges(const ParallelFor& parallel_for, std::size_t count, std::size_t grain,
                const Body& body) {
  if (count > 0) parallel_for(count, grain, body);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
