// A joint that its limit or its motor holds while contacts push the multibody.
//
// What holds a joint exerts an impulse within a range: just the one at which contacts do not move
// the joint. If that one is outside of the range, it exerts the bound, and the joint moves. This is
// a linear complementarity condition with two bounds (Cottle, Pang and Stone 1992, "The linear
// complementarity problem"). An upper limit has the range from minus infinity to 0, a lower one
// that from 0 to infinity. A motor has what Bullet's solve of the step leaves of its largest
// impulse.
#pragma once

#include <cstddef>

#include "lazyccd/bullet/precision.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// What a motor did at the end of a step, and probably does in the next one.
enum class MotorState { idle, holds, exerts_lowest, exerts_highest };

/// A motor of a joint with one coordinate in a step.
struct JointMotor {
  int link;
  double lowest, highest;  ///< impulses that it can add, kg m or kg m^2; lowest <= 0 <= highest
  MotorState last = MotorState::idle;  ///< at the end of the last step
};

struct JointHold {
  std::size_t coordinate;
  double lowest, highest;  ///< range of the impulse, kg m or kg m^2; lowest <= 0 <= highest
  bool is_limit;           ///< the joint is at a limit; false: only a motor holds it
  bool holds;              ///< contacts do not move the joint
  double exerted = 0;      ///< impulse while `holds` is false

  /// How contacts push a joint.
  struct Load {
    double reaction;  ///< impulse that holds it, if it is held
    double moved;     ///< displacement of the joint, if it is not
    double mobility;  ///< displacement per impulse on the joint, if it is not held
    double reaction_tolerance, moved_tolerance;
  };
  /// The hold that fits to the load; the present one if that does.
  JointHold fitted_to(const Load& load) const;
  bool is_same_state(const JointHold& other) const {
    return holds == other.holds && exerted == other.exerted;
  }
  /// Whether the reaction is farther out of the range than the range is wide, as between things
  /// that leave each other no room.
  bool is_beyond(double reaction) const;
  MotorState state() const;
  void set_state(MotorState state);
};

/// Hold of a joint at its limit; `side`: 1: the upper one, -1: the lower one.
JointHold limit_hold(std::size_t coordinate, int side, bool holds);
/// Hold of a joint by its motor. `most`: the largest impulse in either direction, kg m or kg m^2.
JointHold motor_hold(std::size_t coordinate, const JointMotor& motor, double most);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
