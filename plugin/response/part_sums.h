// Sums whose bits do not depend on the number of threads.
#pragma once

#include <cstddef>
#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/threads.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Returns `first` after first.include(sum_of(part)) for the parts 0 to count - 1, in this order.
/// sum_of() returns a Sum and runs on several threads, one call for each part.
template <class Sum, class SumOf>
Sum sum_of_parts(const Threads& threads, std::size_t count, Sum first, const SumOf& sum_of) {
  if (count == 1) {
    first.include(sum_of(0));
    return first;
  }
  std::vector<Sum> sums(count);
  threads.parallel_for(count, 2, [&](std::size_t begin, std::size_t end) {
    for (std::size_t part = begin; part < end; ++part) sums[part] = sum_of(part);
  });
  for (const Sum& sum : sums) first.include(sum);
  return first;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
