// A box that is aligned with the axes.
#pragma once

#include <limits>

#include "util/matrix.h"

namespace lazyccd::bullet {

/// True if no coordinate of a is above that of b.
template <int N>
bool is_below(const Matrix<N, 1>& a, const Matrix<N, 1>& b) {
  for (int i = 0; i < N; ++i)
    if (!(a[i] <= b[i])) return false;
  return true;
}

/// An axis-aligned box of N dimensions; empty without arguments. Its sides belong to it.
template <int N>
class Box {
 public:
  using Point = Matrix<N, 1>;

  Box() : Box(Point::Constant(largest), Point::Constant(-largest)) {}
  explicit Box(const Point& point) : Box(point, point) {}
  Box(const Point& min, const Point& max) : min_(min), max_(max) {}

  const Point& min() const { return min_; }
  const Point& max() const { return max_; }
  bool isEmpty() const { return (max_ - min_).minCoeff() < 0; }
  /// From the lowest corner to the highest one.
  Point diagonal() const { return max_ - min_; }
  Point center() const { return (min_ + max_) / 2; }

  Box& extend(const Point& point) {
    min_ = min_.cwiseMin(point);
    max_ = max_.cwiseMax(point);
    return *this;
  }
  Box& extend(const Box& box) {
    min_ = min_.cwiseMin(box.min_);
    max_ = max_.cwiseMax(box.max_);
    return *this;
  }
  bool contains(const Box& box) const {
    return is_below(min_, box.min_) && is_below(box.max_, max_);
  }
  bool contains(const Point& point) const { return contains(Box(point)); }
  /// Whether both have a point in common.
  bool intersects(const Box& box) const {
    return is_below(min_, box.max_) && is_below(box.min_, max_);
  }

 private:
  static constexpr double largest = std::numeric_limits<double>::max();

  Point min_, max_;
};

using Box2d = Box<2>;
using Box3d = Box<3>;

}  // namespace lazyccd::bullet
