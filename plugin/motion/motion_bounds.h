// Axis-aligned bounds of points over a motion.
#pragma once

#include <cstdint>
#include <limits>

#include "lazyccd/bullet/precision.h"
#include "motion/motion.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// What was added stays inside, metres. Without points they are apart from everything finite.
class MotionBounds {
 public:
  Vector3d lower = Vector3d::Constant(std::numeric_limits<double>::infinity());
  Vector3d upper = -lower;

  MotionBounds() = default;
  /// Of vertices `first` to `last` - 1 in all of the motion. `at_start`: they stay where they
  /// start.
  MotionBounds(const Motion& motion, std::int32_t first, std::int32_t last, bool at_start) {
    for (std::int32_t v = first; v < last; ++v) {
      add(motion.start_of(v));
      if (!at_start) add(motion.end_of(v));
    }
  }
  void add(const Vector3d& x) {
    lower = lower.cwiseMin(x);
    upper = upper.cwiseMax(x);
    sum_ += x;
  }
  void add(const MotionBounds& other) {
    lower = lower.cwiseMin(other.lower);
    upper = upper.cwiseMax(other.upper);
    sum_ += other.sum_;
  }
  /// False if a position is not finite: the bounds mean nothing then.
  bool is_finite() const { return sum_.allFinite(); }

 private:
  // Of all points. It is finite only if all of them are.
  Vector3d sum_ = Vector3d::Zero();
};

/// True if it is certain that both are farther apart than `distance` in the direction of an axis.
inline bool are_apart(const MotionBounds& a, const MotionBounds& b, double distance) {
  return a.is_finite() && b.is_finite() &&
         ((a.lower - b.upper).maxCoeff() > distance || (b.lower - a.upper).maxCoeff() > distance);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
