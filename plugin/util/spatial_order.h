// An order of points in which neighbours in the order are mostly neighbours in space.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace lazyccd::bullet {

/// Returns the indices of the points 0 .. count - 1. Halves the points along their longest extent,
/// and then the halves, down to a few points. `point(i)`: has [0], [1] and [2].
template <class Point>
std::vector<std::int32_t> spatial_order(std::size_t count, const Point& point) {
  constexpr std::ptrdiff_t few = 16;
  std::vector<std::int32_t> order(count);
  std::iota(order.begin(), order.end(), 0);
  const auto halve = [&](const auto& self, auto first, auto last) -> void {
    if (last - first <= few) return;
    auto lower = point(*first), upper = lower;
    for (auto i = first; i != last; ++i) {
      const auto x = point(*i);
      for (int k = 0; k < 3; ++k) {
        lower[k] = std::min(lower[k], x[k]);
        upper[k] = std::max(upper[k], x[k]);
      }
    }
    int axis = 0;
    for (int k = 1; k < 3; ++k)
      if (upper[k] - lower[k] > upper[axis] - lower[axis]) axis = k;
    const auto middle = first + (last - first) / 2;
    // Points at the same place are ordered by index, so that the order is the same everywhere.
    std::nth_element(first, middle, last, [&](std::int32_t a, std::int32_t b) {
      const auto xa = point(a)[axis], xb = point(b)[axis];
      return xa < xb || (xa == xb && a < b);
    });
    self(self, first, middle);
    self(self, middle, last);
  };
  halve(halve, order.begin(), order.end());
  return order;
}

}  // namespace lazyccd::bullet
