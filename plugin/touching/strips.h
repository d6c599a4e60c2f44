// Finds the boxes that overlap: sweep and prune in strips.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/span.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Sweep and prune along the axis with the largest spread, in strips across the axis with the
/// second largest. Without strips, at each place along the axis all boxes across the width of a
/// cloth would overlap.
class Strips {
 public:
  /// `x`: all vertices, metres; `boxes`: about how many boxes there will be.
  Strips(const std::vector<Vector3d>& x, std::size_t boxes) {
    if (x.empty()) return;
    const double count = static_cast<double>(x.size());
    Vector3d mean = Vector3d::Zero(), square = Vector3d::Zero();
    for (const Vector3d& p : x) mean += p / count;
    for (const Vector3d& p : x) square += (p - mean).cwiseProduct(p - mean) / count;
    square.maxCoeff(&along_);
    square[along_] = -1;
    // The width of a uniform distribution with the same variance. The extent of the vertices would
    // be too wide, because the few vertices of a ground lie far out.
    const double width = std::sqrt(12 * square.maxCoeff(&across_));
    if (!(width > 0 && std::isfinite(width))) return;
    strips_ = std::ceil(std::sqrt(static_cast<double>(boxes)));
    lower_ = mean[across_] - 0.5 * width;
    strips_per_metre_ = strips_ / width;
  }

  struct Box {
    Vector3d lower, upper;
    std::int32_t primitive;
    int strip;
  };

  /// Makes the boxes of the primitives that may collide, one for each strip that a primitive
  /// overlaps. Sorted by strip, then by lower end along the axis. Each box is wider on all sides by
  /// `reach(v)` of the vertices v of its primitive, metres.
  template <class Primitives, class Filter, class Reach>
  std::vector<Box> boxes_of(const Primitives& primitives, const std::vector<Vector3d>& x,
                            const Filter& may_collide, const Reach& reach) const {
    std::vector<Box> boxes;
    for (std::size_t i = 0; i < primitives.size(); ++i) {
      if (!may_collide(primitives[i][0])) continue;
      Box box{x[primitives[i][0]], x[primitives[i][0]], static_cast<std::int32_t>(i), 0};
      for (const std::int32_t v : primitives[i]) {
        const Vector3d spare = Vector3d::Constant(reach(v));
        box.lower = box.lower.cwiseMin(x[v] - spare);
        box.upper = box.upper.cwiseMax(x[v] + spare);
      }
      const int last = strip(box.upper);
      for (box.strip = strip(box.lower); box.strip <= last; ++box.strip) boxes.push_back(box);
    }
    std::sort(boxes.begin(), boxes.end(),
              [this](const Box& a, const Box& b) { return place(a) < place(b); });
    return boxes;
  }

  /// Calls test(a, b) once for each two boxes that overlap along the axis and share a
  /// strip.
  template <class Test>
  void sweep(const std::vector<Box>& a, const std::vector<Box>& b, Test&& test) const {
    // A pair is found at the lower end of the box that begins later.
    visit_starts(a, b, std::less<>(), test);
    visit_starts(b, a, std::less_equal<>(), [&](const Box& y, const Box& x) { test(x, y); });
  }

 private:
  // Index of the strip of a point. Points outside of the width are in the first or the last strip.
  int strip(const Vector3d& p) const {
    return static_cast<int>(std::clamp((p[across_] - lower_) * strips_per_metre_, 0.0, strips_));
  }
  std::pair<int, double> place(const Box& box) const { return {box.strip, box.lower[along_]}; }

  // Calls test() for each box of `b` that begins inside of a box of `a`.
  template <class Before, class Test>
  void visit_starts(const std::vector<Box>& a, const std::vector<Box>& b, Before before,
                    Test&& test) const {
    std::size_t j = 0;
    for (const Box& box : a) {
      while (j < b.size() && before(place(b[j]), place(box))) ++j;
      const std::pair<int, double> end(box.strip, box.upper[along_]);
      for (std::size_t k = j; k < b.size() && place(b[k]) <= end; ++k) {
        // Test a pair only in the first strip that both overlap.
        if (box.strip == std::max(strip(box.lower), strip(b[k].lower))) test(box, b[k]);
      }
    }
  }

  int along_ = 0, across_ = 1;
  double lower_ = 0, strips_per_metre_ = 0, strips_ = 0;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
