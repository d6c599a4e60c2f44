#include "step/joint_motors.h"

#include <BulletDynamics/Featherstone/btMultiBodyConstraint.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>

#include <algorithm>
#include <cmath>

#include "motion/articulated_motion.h"
#include "settings.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Whether getAppliedImpulse() may be asked: Bullet makes room for it when it first solves the
// constraint, or in finalizeMultiDof().
bool has_applied_impulse(const btMultiBodyConstraint& constraint) {
  struct Access : btMultiBodyConstraint {
    static auto data() { return &Access::m_data; }
  };
  return (constraint.*Access::data()).size() > 0;
}

bool is_motor(const btMultiBodyConstraint& constraint) {
  return constraint.getConstraintType() == MULTIBODY_CONSTRAINT_1DOF_JOINT_MOTOR &&
         has_applied_impulse(constraint);
}

bool are_same(const MultibodyPose& a, const MultibodyPose& b) {
  return a.base_position == b.base_position && a.world_to_base == b.world_to_base &&
         a.joints == b.joints;
}

}  // namespace

void JointMotors::set_world(btMultiBodyDynamicsWorld* world) {
  world_ = world;
  motors_.clear();
  forget();
}

void JointMotors::begin_step() {
  if (!world_ || motors_.empty()) return;
  for (int i = 0; i < world_->getNumMultiBodyConstraints(); ++i) {
    btMultiBodyConstraint* const constraint = world_->getMultiBodyConstraint(i);
    if (!is_motor(*constraint)) continue;
    const auto motor = std::find_if(motors_.begin(), motors_.end(), [constraint](const Motor& m) {
      return m.constraint == constraint;
    });
    if (motor != motors_.end() &&
        constraint->getAppliedImpulse(0) == static_cast<btScalar>(motor->told))
      constraint->internalSetAppliedImpulse(0, static_cast<btScalar>(motor->applied));
  }
  motors_.clear();
}

MotorState JointMotors::last_state(const ArticulatedMotion& body,
                                   const btMultiBodyConstraint* constraint) const {
  for (const Last& last : last_) {
    // A body that was put elsewhere begins anew.
    if (last.body != body.body || !are_same(last.end, body.start)) continue;
    for (const Motor& motor : last.motors)
      if (motor.constraint == constraint) return motor.state;
  }
  return MotorState::idle;
}

void JointMotors::find(Motion& motion) {
  motors_.clear();
  if (!world_ || motion.articulated.empty()) return;
  std::vector<std::vector<JointMotor>> found(motion.articulated.size());
  for (int i = 0; i < world_->getNumMultiBodyConstraints(); ++i) {
    btMultiBodyConstraint* const constraint = world_->getMultiBodyConstraint(i);
    if (!is_motor(*constraint)) continue;
    const btMultiBody* const body = constraint->getMultiBodyA();
    const int link = constraint->getLinkA();
    const auto moved = std::find_if(motion.articulated.begin(), motion.articulated.end(),
                                    [body](const ArticulatedMotion& a) { return a.body == body; });
    if (moved == motion.articulated.end() || link < 0 || body->getLink(link).m_dofCount != 1)
      continue;
    const auto max = static_cast<double>(constraint->getMaxAppliedImpulse());
    const auto applied = static_cast<double>(constraint->getAppliedImpulse(0));
    if (!(max > 0) || !(std::abs(applied) < settings::joints::almost_all * max)) continue;
    std::vector<JointMotor>& of_body =
        found[static_cast<std::size_t>(moved - motion.articulated.begin())];
    if (std::any_of(of_body.begin(), of_body.end(),
                    [link](const JointMotor& motor) { return motor.link == link; }))
      continue;  // one motor holds a joint
    of_body.push_back({link, motion.dt() * (-max - applied), motion.dt() * (max - applied),
                       last_state(*moved, constraint)});
    motors_.push_back({constraint, body,
                       6 + static_cast<std::size_t>(body->getLink(link).m_dofOffset), applied,
                       applied, MotorState::idle});
  }
  for (std::size_t a = 0; a < found.size(); ++a)
    if (!found[a].empty()) motion.articulated[a].set_motors(found[a], motion.dt());
}

void JointMotors::end_step(const Motion& motion) {
  forget();
  for (const ArticulatedMotion& body : motion.articulated) {
    if (body.held || !body.is_pushed()) continue;
    const std::vector<JointHold> next = body.next_holds();
    const DenseVector reactions = body.reactions(body.impulse);
    Last last{body.body, pose_of(*body.body), {}};
    for (Motor& motor : motors_) {
      if (motor.body != body.body) continue;
      const auto hold = std::find_if(next.begin(), next.end(), [&motor](const JointHold& h) {
        return h.coordinate == motor.coordinate;
      });
      if (hold == next.end()) continue;
      motor.state = hold->state();
      if (!hold->is_limit) {
        const double max = static_cast<double>(motor.constraint->getMaxAppliedImpulse());
        const double told = motor.applied + reactions[motor.coordinate] / motion.dt();
        if (std::isfinite(told)) motor.told = std::clamp(told, -max, max);
        motor.constraint->internalSetAppliedImpulse(0, static_cast<btScalar>(motor.told));
      }
      last.motors.push_back(motor);
    }
    if (!last.motors.empty()) last_.push_back(std::move(last));
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
