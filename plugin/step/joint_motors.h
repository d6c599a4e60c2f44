// The joint motors of a world's multibodies, as the response needs them (joint_hold.h).
//
// Bullet has solved the motors of the step already. What they have left of their largest impulse
// holds joints against contacts. A motor that has nothing left does nothing more.
#pragma once

#include <vector>

#include "motion/articulated_motion.h"
#include "motion/motion.h"

class btMultiBodyConstraint;
class btMultiBodyDynamicsWorld;

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class JointMotors {
 public:
  /// The world in whose steps the motors act; null: motors do nothing here.
  void set_world(btMultiBodyDynamicsWorld* world);
  /// Starts a step: Bullet's motors get their own impulses back, in case Bullet does not solve
  /// them.
  void begin_step();
  /// Gives the motors to the multibodies of a motion, before its response.
  void find(Motion& motion);
  /// After the response: remembers which joints were held, and tells Bullet's motors which impulse
  /// they have exerted.
  void end_step(const Motion& motion);
  /// Forgets which joints were held.
  void forget() { last_.clear(); }

 private:
  // A motor that takes part in the step.
  struct Motor {
    btMultiBodyConstraint* constraint;
    const btMultiBody* body;
    std::size_t coordinate;
    double applied;  // by Bullet's solve, N s or N m s
    double told;     // with what the response adds
    MotorState state;
  };
  // A multibody at the end of the last step.
  struct Last {
    const btMultiBody* body;
    MultibodyPose end;
    std::vector<Motor> motors;
  };

  MotorState last_state(const ArticulatedMotion& body, const btMultiBodyConstraint* motor) const;

  btMultiBodyDynamicsWorld* world_ = nullptr;
  std::vector<Motor> motors_;  // of this step
  std::vector<Last> last_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
