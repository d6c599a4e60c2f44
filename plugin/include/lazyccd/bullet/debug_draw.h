// What debug_draw() of the solvers draws of the last step.
#pragma once

#include "lazyccd/bullet/precision.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Parts of the drawing, and its lengths in metres.
struct DebugDrawOptions {
  /// The normal of each contact, from its point on b, in the colour of its island. Grey: the
  /// contact is only reported.
  bool contacts = true;
  /// Impulses on a, with friction, from the same point, in white.
  bool impulses = true;
  /// A box around the bodies that contacts connect; each island has its own colour. Static and
  /// kinematic bodies belong to none.
  bool islands = true;
  /// Impact zones, in orange: a box around each, and a cross at each node that moves with it.
  bool zones = true;
  /// What the fail-safe holds at the start of the step, in red: a cross at each node, a box around
  /// each rigid body.
  bool holds = true;
  double normal_length = 0.05;
  double impulse_length = 0.2;  ///< of the largest impulse of an island; others in proportion
  double cross_size = 0.02;     ///< from end to end
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
