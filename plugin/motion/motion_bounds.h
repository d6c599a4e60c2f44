// Axis-aligned bounds of vertices over a motion.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "lazyccd/bullet/precision.h"
#include "motion/motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// All points between vertices `first` and `last` - 1 stay inside in the motion, metres.
/// `at_start`: the vertices stay where they start.
struct MotionBounds {
  Eigen::Vector3d lower, upper;
  bool is_finite = true;  ///< false: a position is not, and the bounds mean nothing

  MotionBounds(const Motion& motion, std::int32_t first, std::int32_t last, bool at_start)
      : lower(motion.start_of(first)), upper(lower) {
    for (std::int32_t v = first; v < last; ++v) {
      add(motion.start_of(v));
      if (!at_start) add(motion.end_of(v));
    }
  }

 private:
  void add(const Eigen::Vector3d& x) {
    lower = lower.cwiseMin(x);
    upper = upper.cwiseMax(x);
    is_finite = is_finite && x.allFinite();
  }
};

/// True if it is certain that both are farther apart than `distance` in the direction of an axis.
inline bool are_apart(const MotionBounds& a, const MotionBounds& b, double distance) {
  return a.is_finite && b.is_finite &&
         ((a.lower - b.upper).maxCoeff() > distance || (b.lower - a.upper).maxCoeff() > distance);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
