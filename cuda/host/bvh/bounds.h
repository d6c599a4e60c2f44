// The box around many points, found on all threads.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

#include "core/bvh/morton.h"
#include "host/threads/thread_pool.h"

namespace lazyccd {

/// An axis-aligned box that grows. Aligned against false sharing.
struct alignas(128) Bounds {
  double lo[3] = {kMost, kMost, kMost}, hi[3] = {-kMost, -kMost, -kMost};

  /// Adds a box.
  template <class T>
  void add(const T* lower, const T* upper) {
    for (int k = 0; k < 3; ++k) {
      lo[k] = std::min<double>(lo[k], lower[k]);
      hi[k] = std::max<double>(hi[k], upper[k]);
    }
  }
  MortonFrame morton_frame() const { return MortonFrame::around(lo, hi); }

 private:
  static constexpr double kMost = std::numeric_limits<double>::max();
};

/// Returns the bounds of `count` things; add(i, bounds) adds one.
template <class Add>
Bounds find_bounds(std::size_t count, ThreadPool& pool, Add&& add) {
  std::vector<Bounds> of_worker(static_cast<std::size_t>(pool.size()));
  pool.parallel_for(count, 1 << 13, [&](std::size_t first, std::size_t last, int worker) {
    Bounds bounds = of_worker[worker];
    for (std::size_t i = first; i < last; ++i) add(i, bounds);
    of_worker[worker] = bounds;
  });
  Bounds all;
  for (const Bounds& bounds : of_worker) all.add(bounds.lo, bounds.hi);
  return all;
}

}  // namespace lazyccd
