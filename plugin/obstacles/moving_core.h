// The core of a ball or capsule over a motion: a point or a segment that moves, and what is closest
// to it.
#pragma once

#include <array>

#include "motion/motion.h"
#include "motion/motion_bounds.h"
#include "motion/primitive_points.h"
#include "shapes/round_part.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// The closest points of a core and a primitive.
struct ClosestPoints {
  double distance;                ///< metres; 0: they intersect
  double along;                   ///< place on the core: 0 at its first end, 1 at the other
  std::array<double, 3> weights;  ///< place on the primitive, by vertex; their sum is 1
  Vector3d between;               ///< from the core to the primitive, metres
};

class MovingCore {
 public:
  /// The core at the start and at the end of a motion; `at_start`: it stays where it starts.
  MovingCore(const RoundPart& part, const RigidMotion& rigid, bool at_start);

  /// Bounds of the core over the motion.
  MotionBounds bounds() const;
  /// Distance from a vertex at time t in [0, 1], metres.
  double distance(const Vector3d& x, double t) const;
  /// What is closest at time t.
  ClosestPoints closest(const PrimitivePoints& primitive, double t) const;
  /// Finds the first time at which the distance of a primitive is at most `near_distance`, metres,
  /// and what is closest then. False if it stays farther away. What passes by may be reported
  /// although it is a little farther away.
  bool find_near(const PrimitivePoints& start, const PrimitivePoints& end, double near_distance,
                 double& time, ClosestPoints& points) const;
  /// Upper bound of how far a vertex moves relative to any point of the core, metres.
  double relative_move(const Vector3d& x0, const Vector3d& x1) const;
  /// Lower bound of the distance of a vertex over the whole motion. Exact if the core does not
  /// turn.
  double smallest_distance(const Vector3d& x0, const Vector3d& x1) const;
  /// True if it is certain that a primitive stays farther away than `radius` in the whole motion.
  bool is_farther(double radius, const PrimitivePoints& start, const PrimitivePoints& end) const;
  /// Upper bound of the rounding of Bullet's positions of the part's vertices, metres.
  double rounding(double radius) const;

 private:
  struct Segment {
    Vector3d first, last;
  };
  Segment at(double t) const {
    return {(1 - t) * start_.first + t * end_.first, (1 - t) * start_.last + t * end_.last};
  }
  // True if some plane has the core, thickened by `radius`, on one side and the primitive on the
  // other, from time t0 to t1. Halves the time at most `halvings` times to find planes.
  bool is_farther(double radius, const PrimitivePoints& start, const PrimitivePoints& end,
                  double t0, double t1, int halvings) const;

  Segment start_, end_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
