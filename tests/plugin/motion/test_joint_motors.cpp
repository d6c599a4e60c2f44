// Joints with motors: contacts do not move them, as far as the motors' impulses allow.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletDynamics/Featherstone/btMultiBodyJointMotor.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "motion/articulated_motion.h"
#include "plugin/support/arm.h"
#include "plugin/support/obstacle_worlds.h"
#include "response/velocities.h"
#include "scenes/behaviour/multibody.h"
#include "scenes/meshes/solid.h"
#include "step/joint_motors.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;
using bullet::ArticulatedMotion;
using bullet::JointHold;
using bullet::MotorState;
using Update = bullet::ArticulatedMotion::Update;
using scenes::World;
using scenes::behaviour::BoxLink;
using scenes::behaviour::Joint;
using scenes::behaviour::Multibody;

namespace {

btVector3 vector(double x, double y, double z) {
  return btVector3(static_cast<btScalar>(x), static_cast<btScalar>(y), static_cast<btScalar>(z));
}

double fastest_node(const btSoftBody& body) {
  btScalar fastest = 0;
  for (int i = 0; i < body.m_nodes.size(); ++i)
    fastest = std::max(fastest, body.m_nodes[i].m_v.length());
  return static_cast<double>(fastest);
}

BoxLink slider(int parent, const btVector3& axis, const btVector3& pivot, const btVector3& size,
               double mass) {
  BoxLink link;
  link.parent = parent;
  link.joint = Joint::prismatic;
  link.axis = axis;
  link.pivot = pivot;
  link.size = size;
  link.mass = mass;
  return link;
}

// A world with a multibody whose motors hold their joints against contacts.
class MotorWorld {
 public:
  MotorWorld(World kind, double hz, double gravity = 10)
      : world_(kind, gravity, {}, true), step_(1 / hz) {
    world_.use_motors();
  }

  ObstacleWorld& operator*() { return world_; }
  ObstacleWorld* operator->() { return &world_; }
  btMultiBody& body() { return machine_->body(); }
  double joint(int link) { return static_cast<double>(body().getJointPos(link)); }
  double joint_speed(int link) { return static_cast<double>(body().getJointVel(link)); }
  btSoftBody& soft() { return *soft_; }

  void add_floor(double half) {
    world_.add(std::make_unique<btBoxShape>(vector(half, 0.1, half)), vector(0, -0.1, 0));
  }
  void take(btSoftBody* soft, double mass) {
    soft_ = soft;
    soft->setTotalMass(static_cast<btScalar>(mass));
    soft->m_cfg.kDF = 1;
    soft->m_cfg.collisions |= btSoftBody::fCollision::SDF_MDF;
  }
  // `base_mass` 0: the base is fixed.
  void add_machine(const btVector3& place, const btVector3& base_size, double base_mass,
                   const std::vector<BoxLink>& links) {
    machine_ = std::make_unique<Multibody>(place, base_size, base_mass > 0 ? base_mass : 1,
                                           base_mass == 0, links);
    body().setCanSleep(false);
    machine_->add_to(static_cast<btMultiBodyDynamicsWorld&>(world_.world()));
  }
  // A motor that holds its joint at a speed, m/s; `force`: N.
  btMultiBodyJointMotor& add_motor(int link, double force, double speed = 0) {
    motors_.push_back(machine_->add_motor(link, force, step_));
    motors_.back()->setPositionTarget(0, 0);
    motors_.back()->setVelocityTarget(static_cast<btScalar>(speed), 1);
    return *motors_.back();
  }
  // Motors go the other way.
  void open() {
    for (btMultiBodyJointMotor* const motor : motors_) motor->setVelocityTarget(btScalar(-0.5), 1);
  }
  double force(int motor) {
    return static_cast<double>(motors_[static_cast<std::size_t>(motor)]->getAppliedImpulse(0)) /
           step_;
  }
  // Returns the speed of the fastest node in this time, m/s.
  double run(double seconds, const std::function<void(double time)>& each = {}) {
    double fastest = 0;
    for (int i = 0; i < seconds / step_; ++i) {
      world_.steps(1, step_);
      time_ += step_;
      fastest = std::max(fastest, fastest_node(soft()));
      if (each) each(time_);
    }
    return fastest;
  }

 private:
  ObstacleWorld world_;
  double step_, time_ = 0;
  btSoftBody* soft_ = nullptr;
  std::vector<btMultiBodyJointMotor*> motors_;
  std::unique_ptr<Multibody> machine_;  // last: it leaves the world first
};

// A body of 10 kg on a foot of 0.2 kg, on cloth on a floor.
void build_leg(MotorWorld& w, double force) {
  w.add_floor(1);
  w.take(w->add_sheet(9, 0.6, 0.021, 0), 0.3);
  const btVector3 up(0, 1, 0);
  w.add_machine(vector(0, 0.3, 0), vector(0.2, 0.2, 0.2), 10,
                {slider(-1, up, vector(0, -0.24, 0), vector(0.2, 0.06, 0.2), 0.2)});
  w.add_motor(0, force);
}

// Two fingers that close at 0.5 m/s.
void add_gripper(MotorWorld& w, double force) {
  std::vector<BoxLink> fingers;
  for (const double side : {-1.0, 1.0}) {
    fingers.push_back(
        slider(-1, vector(0, 0, -side), vector(0, 0, side * 0.15), vector(0.1, 0.1, 0.04), 0.5));
  }
  w.add_machine(btVector3(0, 0, 0), btVector3(0, 0, 0), 0, fingers);
  for (const int finger : {0, 1}) w.add_motor(finger, force, 0.5);
}

// Hold of a motor of 2 kg m, of which Bullet has used `applied`.
JointHold motor_of_two(double applied, MotorState last) {
  return bullet::motor_hold(6, {0, -2 - applied, 2 - applied, last}, 100);
}
JointHold::Load reaction(double impulse) { return {impulse, 0, 0, 1e-6, 1e-6}; }
JointHold::Load displacement(double moved) { return {0, moved, 1, 1e-6, 1e-6}; }

bullet::DenseVector on_joints(double first, double second) {
  const std::vector<double> generalized = {0, 0, 0, 0, 0, 0, first, second};
  return {generalized.begin(), generalized.end()};
}

constexpr World worlds[] = {World::rigid, World::deformable};

}  // namespace

TEST_CASE("a motor holds its joint while the reaction is in its range") {
  const JointHold held = motor_of_two(0.5, MotorState::holds);
  CHECK(held.fitted_to(reaction(1.4)).state() == MotorState::holds);
  CHECK(held.fitted_to(reaction(-2.4)).state() == MotorState::holds);
  CHECK(held.fitted_to(reaction(1.6)).state() == MotorState::exerts_highest);
  CHECK(held.fitted_to(reaction(1.6)).exerted == 1.5);
  CHECK(held.fitted_to(reaction(-2.6)).exerted == -2.5);
  CHECK(!held.is_beyond(5));
  CHECK(held.is_beyond(6));

  const JointHold idle = motor_of_two(0.5, MotorState::idle);
  CHECK(idle.fitted_to(displacement(0)).state() == MotorState::idle);
  CHECK(idle.fitted_to(displacement(-1)).state() == MotorState::holds);
  CHECK(idle.fitted_to(displacement(1)).state() == MotorState::holds);
  // Even with contacts as weak as they are, it could not hold the joint.
  CHECK(idle.fitted_to(displacement(-1.7)).state() == MotorState::exerts_highest);
  CHECK(idle.fitted_to(displacement(2.7)).state() == MotorState::exerts_lowest);

  const JointHold exerts = motor_of_two(0.5, MotorState::exerts_highest);
  CHECK(exerts.exerted == 1.5);
  CHECK(exerts.fitted_to(displacement(-1)).state() == MotorState::exerts_highest);
  CHECK(exerts.fitted_to(displacement(1)).state() == MotorState::holds);
}

TEST_CASE("motors of a multibody hold, give way, and hold again") {
  ObstacleWorld w(World::deformable, 0);
  Arm arm(w, 2, true, btVector3(0, 0, 0));
  w.steps(1, 1.0 / 240);  // Bullet computes the inertia of the joints
  ArticulatedMotion motion(arm.body(), bullet::pose_of(arm.body()));
  motion.add_link(0, 0, arm.link(0).getWorldTransform().getOrigin());
  motion.add_link(1, 1, arm.link(1).getWorldTransform().getOrigin());
  const bullet::DenseMatrix free = motion.inverse_mass;
  motion.set_motors({{0, -0.1, 0.1, MotorState::idle}, {1, -0.1, 0.1, MotorState::idle}}, 1);
  REQUIRE(motion.holds.size() == 2);
  CHECK(motion.inverse_mass == free);

  motion.impulse = on_joints(0.05, 0);
  motion.displacement = motion.inverse_mass * motion.impulse;
  CHECK(!motion.update_holds(Update::last).any);  // no motor takes hold then
  CHECK(motion.update_holds(Update::all).any);
  CHECK(motion.inverse_mass == bullet::DenseMatrix(8, 8));
  CHECK((motion.reactions(motion.impulse) - on_joints(-0.05, 0)).norm_infinity() < 1e-12);
  // Work of motors is no gain of energy by contacts.
  CHECK(motion.with_limits(motion.impulse) == motion.impulse);

  motion.displacement.setZero();
  motion.impulse = on_joints(0.15, 0);
  const ArticulatedMotion::Changes changes = motion.update_holds(Update::weaken_motors);
  CHECK(changes.any);
  CHECK(!changes.any_beyond);
  CHECK(motion.motor_impulse == on_joints(-0.1, 0));
  CHECK(motion.inverse_mass(6, 6) > 0);
  CHECK(motion.inverse_mass(7, 7) == 0);
  // The motor is strong enough after all.
  motion.impulse = on_joints(0.05, 0);
  motion.displacement = motion.inverse_mass * (motion.impulse + motion.motor_impulse);
  CHECK(motion.next_holds()[0].holds);
  CHECK(motion.update_holds(Update::weaken_motors).any);
  CHECK(motion.motor_impulse.isZero());
  CHECK(motion.holds[0].state() == MotorState::idle);
}

TEST_CASE("what is known of motors ends where the application moves the multibody") {
  ObstacleWorld w(World::deformable, 0);
  Arm arm(w, 1, true, btVector3(0, 0, 0));
  auto& world = static_cast<btMultiBodyDynamicsWorld&>(w.world());
  btMultiBodyJointMotor motor(&arm.body(), 0, 0, btScalar(0.5));
  motor.finalizeMultiDof();
  world.addMultiBodyConstraint(&motor);
  w.steps(1, 1.0 / 240);
  bullet::JointMotors motors;
  motors.set_world(&world);
  bullet::Motion motion;
  const auto begin = [&] {
    motion.articulated.clear();
    motion.articulated.emplace_back(arm.body(), bullet::pose_of(arm.body()));
    motion.articulated[0].add_link(0, 0, arm.link(0).getWorldTransform().getOrigin());
    motors.find(motion);
  };
  begin();
  ArticulatedMotion& body = motion.articulated[0];
  REQUIRE(body.holds.size() == 1);
  CHECK(!body.holds[0].holds);
  body.impulse[6] = 0.1;
  body.displacement = body.inverse_mass * body.impulse;
  body.update_holds(Update::all);
  body.displacement.setZero();
  motors.end_step(motion);
  CHECK(static_cast<double>(motor.getAppliedImpulse(0)) == Approx(-0.1));
  motors.begin_step();
  CHECK(motor.getAppliedImpulse(0) == 0);  // Bullet's own

  SECTION("the body goes on") {
    begin();
    CHECK(motion.articulated[0].holds[0].holds);
  }
  SECTION("it is moved") {
    arm.set_joints(0.1);
    begin();
    CHECK(!motion.articulated[0].holds[0].holds);
  }
  SECTION("the motor has no force, or has given all") {
    motor.setMaxAppliedImpulse(0);
    begin();
    CHECK(motion.articulated[0].holds.empty());
    motor.setMaxAppliedImpulse(btScalar(0.5));
    motor.internalSetAppliedImpulse(0, btScalar(0.5));
    begin();
    CHECK(motion.articulated[0].holds.empty());
  }
  world.removeMultiBodyConstraint(&motor);
}

TEST_CASE("a motor that Bullet has not set up does nothing") {
  ObstacleWorld w(World::deformable, 0);
  Arm arm(w, 1, true, btVector3(0, 0, 0));
  w.steps(1, 1.0 / 240);
  auto& world = static_cast<btMultiBodyDynamicsWorld&>(w.world());
  btMultiBodyJointMotor motor(&arm.body(), 0, 0, btScalar(0.5));  // without finalizeMultiDof()
  world.addMultiBodyConstraint(&motor);
  bullet::JointMotors motors;
  motors.set_world(&world);
  bullet::Motion motion;
  motion.articulated.emplace_back(arm.body(), bullet::pose_of(arm.body()));
  motion.articulated[0].add_link(0, 0, arm.link(0).getWorldTransform().getOrigin());
  motors.find(motion);
  CHECK(motion.articulated[0].holds.empty());
  motors.end_step(motion);
  motors.begin_step();
  world.removeMultiBodyConstraint(&motor);
}

TEST_CASE("the change of a multibody whose motors hold all joints stays finite") {
  ObstacleWorld w(World::deformable, 0);
  Arm arm(w, 1, true, btVector3(0, 0, 0));
  w.steps(1, 1.0 / 240);
  bullet::Motion motion;
  motion.articulated.emplace_back(arm.body(), bullet::pose_of(arm.body()));
  ArticulatedMotion& body = motion.articulated[0];
  // Contacts push along the motion, and nothing gets another velocity.
  const std::vector<double> alike(7, 0.1);
  body.velocity = body.momentum_change = bullet::DenseVector(alike.begin(), alike.end());
  body.velocity_change = bullet::DenseVector(7);
  const std::vector<int> articulated = {0};
  const std::vector<std::size_t> parts = {0};  // no other masses
  std::vector<bullet::Island> islands(1);
  islands[0].articulated = articulated;
  islands[0].parts = parts;
  const Threads threads(1);
  bullet::limit_kinetic_energy(islands, threads, motion);
  CHECK(body.momentum_change.isZero());
  CHECK(body.velocity_change.isZero());
}

TEST_CASE("contacts move joints as if no motor held them if the world is not told") {
  MotorWorld w(World::deformable, 240);
  w->use_motors(false);
  build_leg(w, 1000);
  w.run(0.7);
  CHECK(w.joint(0) > 0.05);
}

TEST_CASE("a light foot on cloth carries a heavy body by its motor") {
  for (const World kind : worlds) {
    for (const double hz : {60.0, 240.0}) {
      CAPTURE(kind == World::rigid, hz);
      MotorWorld w(kind, hz);
      build_leg(w, 1000);
      double sag = 0;
      w.run(0.7, [&](double) { sag = std::max(sag, std::abs(w.joint(0))); });
      CHECK(sag < 0.005);
      CHECK(w.force(0) == Approx(-100).margin(5));
      CHECK(w->total().failsafe_holds == 0);
    }
  }
}

TEST_CASE("motors beside the way from the base to the foot hold, too") {
  for (const World kind : worlds) {
    for (const double hz : {60.0, 240.0}) {
      CAPTURE(kind == World::rigid, hz);
      MotorWorld w(kind, hz);
      w.add_floor(1);
      w.take(w->add_sheet(9, 0.6, 0.021, 0), 0.3);
      // A foot below the base, and a trunk that leans over from a hinge above it.
      BoxLink trunk;
      trunk.joint = Joint::revolute;
      trunk.axis = btVector3(0, 0, 1);
      trunk.pivot = vector(0, 0.05, 0);
      trunk.centre = vector(0.05, 0.2, 0);
      trunk.size = vector(0.1, 0.3, 0.1);
      trunk.mass = 10;
      const btVector3 up(0, 1, 0);
      w.add_machine(vector(0, 0.3, 0), vector(0.1, 0.1, 0.1), 0.5,
                    {slider(-1, up, vector(0, -0.24, 0), vector(0.3, 0.06, 0.3), 0.2), trunk});
      w.add_motor(0, 1000);
      w.add_motor(1, 100);
      w.run(0.7);
      CHECK(std::abs(w.joint(0)) < 0.002);
      CHECK(std::abs(w.joint(1)) < 0.01);
      CHECK(w.force(1) == Approx(5).margin(0.5));  // N m
    }
  }
}

TEST_CASE("a motor that is too weak for its load gives what it can") {
  for (const World kind : worlds) {
    for (const double hz : {60.0, 240.0}) {
      CAPTURE(kind == World::rigid, hz);
      MotorWorld w(kind, hz);
      build_leg(w, 50);
      // Half of gravity accelerates the body while the foot stands.
      double first_time = 0, first_speed = 0, acceleration = 0, slowest = 0;
      w.run(0.5, [&](double time) {
        slowest = std::min(slowest, w.joint_speed(0));
        if (w.joint(0) > 0.15) return;
        if (w.joint(0) < 0.02) {
          first_time = time;
          first_speed = w.joint_speed(0);
        } else {
          acceleration = (w.joint_speed(0) - first_speed) / (time - first_time);
        }
      });
      CHECK(acceleration == Approx(5).margin(0.5));
      CHECK(w.joint(0) > 0.165);  // the body is on the floor
      CHECK(slowest > -0.05);     // it does not bounce
    }
  }
}

TEST_CASE("fingers press cloth between them as hard as their motors can, and open again") {
  for (const World kind : worlds) {
    for (const double force : {5.0, 20.0, 100.0, 1e4}) {
      CAPTURE(kind == World::rigid, force);
      MotorWorld w(kind, 240, 0);
      std::mt19937 random(3);
      scenes::Sheet sheet{9, 9, 0.3, 0.3};
      sheet.jitter = 0.001;
      auto cloth = scenes::make_sheet(w->info(), sheet, random);
      cloth->rotate(btQuaternion(vector(1, 0, 0), SIMD_HALF_PI));
      w.take(w->add(std::move(cloth)), 0.1);
      add_gripper(w, force);
      const double fastest = w.run(0.6);
      CHECK(fastest < 6);
      const double gap = 0.26 - w.joint(0) - w.joint(1);
      CHECK(gap > 0.01);
      CHECK(gap < 0.03);
      if (force <= 100) CHECK(w.force(0) == Approx(force).epsilon(0.1));
      w.open();
      w.run(0.3);
      CHECK(0.26 - w.joint(0) - w.joint(1) > 0.15);
    }
  }
}

TEST_CASE("fingers press a soft block no farther than their motors can") {
  for (const World kind : worlds) {
    for (const double force : {5.0, 20.0, 100.0}) {
      CAPTURE(kind == World::rigid, force);
      MotorWorld w(kind, 240, 0);
      w.take(w->add(scenes::make_solid(w->info(), 4, 0.3,
                                       [](double x, double y, double z) {
                                         return vector(0.12 * (x - 0.5), 0.12 * (y - 0.5),
                                                       0.12 * (z - 0.5));
                                       })),
             0.3);
      add_gripper(w, force);
      const double fastest = w.run(0.5);
      CHECK(fastest < 10);
      CHECK(w.force(0) < 1.01 * force);
      CHECK(0.26 - w.joint(0) - w.joint(1) > 0.01);
      w.open();
      w.run(0.3);
      CHECK(0.26 - w.joint(0) - w.joint(1) > 0.15);
    }
  }
}

TEST_CASE("a hand presses cloth on a table as hard as its motor can") {
  for (const World kind : worlds) {
    for (const double force : {20.0, 100.0, 1e4}) {
      CAPTURE(kind == World::rigid, force);
      MotorWorld w(kind, 60);
      w.add_floor(0.3);
      w.take(w->add_sheet(13, 0.8, 0.012, 0), 0.3);
      w.add_machine(vector(0.02, 0.2, 0.01), btVector3(0, 0, 0), 0,
                    {slider(-1, vector(0, -1, 0), btVector3(0, 0, 0), vector(0.12, 0.2, 0.12), 1)});
      w.add_motor(0, force, 0.5);
      const double fastest = w.run(0.7);
      CHECK(fastest < 5);
      CHECK(w.joint(0) > 0.06);
      CHECK(w.joint(0) < 0.1);  // the hand is above the table
      if (force <= 100) CHECK(w.force(0) == Approx(force).epsilon(0.1));
      CHECK(w->total().failsafe_holds == 0);
    }
  }
}
