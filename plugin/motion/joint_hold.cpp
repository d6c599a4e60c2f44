#include "motion/joint_hold.h"

#include <algorithm>
#include <limits>

#include "settings.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

JointHold JointHold::fitted_to(const Load& load) const {
  JointHold fitted = *this;
  if (holds) {
    const double spare = is_limit ? 0 : settings::joints::slack * (highest - lowest);
    if (load.reaction > highest + spare + load.reaction_tolerance) {
      fitted.exerted = highest;
    } else if (load.reaction < lowest - spare - load.reaction_tolerance) {
      fitted.exerted = lowest;
    } else {
      return fitted;
    }
    fitted.holds = false;
    return fitted;
  }
  const bool can_push_up = exerted < highest;
  const bool can_push_down = exerted > lowest;
  if (!(can_push_up && load.moved < -load.moved_tolerance) &&
      !(can_push_down && load.moved > load.moved_tolerance))
    return fitted;
  // The impulse that stops the joint, if contacts stay as strong as they are. They do not get
  // weaker, so a motor that cannot exert that does not hold the joint.
  const double needed = load.mobility > 0 ? exerted - load.moved / load.mobility : 0;
  if (needed > highest || needed < lowest) {
    fitted.exerted = std::clamp(needed, lowest, highest);
  } else {
    fitted.holds = true;
    fitted.exerted = 0;
  }
  return fitted;
}

bool JointHold::is_beyond(double reaction) const {
  const double range = highest - lowest;
  return reaction > highest + range || reaction < lowest - range;
}

MotorState JointHold::state() const {
  if (holds) return MotorState::holds;
  if (exerted == 0) return MotorState::idle;
  return exerted > 0 ? MotorState::exerts_highest : MotorState::exerts_lowest;
}

void JointHold::set_state(MotorState state) {
  holds = state == MotorState::holds;
  exerted = state == MotorState::exerts_highest  ? highest
            : state == MotorState::exerts_lowest ? lowest
                                                 : 0;
}

JointHold limit_hold(std::size_t coordinate, int side, bool holds) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  return {coordinate, side > 0 ? -infinity : 0, side > 0 ? 0 : infinity, true, holds};
}

JointHold motor_hold(std::size_t coordinate, const JointMotor& motor, double most) {
  JointHold hold{coordinate, std::max(motor.lowest, -most), std::min(motor.highest, most), false,
                 false};
  hold.set_state(motor.last);
  return hold;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
