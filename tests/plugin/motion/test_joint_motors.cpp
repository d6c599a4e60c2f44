// Joints with motors: contacts do not move them, as far as the motors' impulses allow.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletDynamics/Featherstone/btMultiBodyJointMotor.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "plugin/support/obstacle_worlds.h"
#include "scenes/behaviour/multibody.h"
#include "scenes/meshes/solid.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;
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

constexpr World worlds[] = {World::rigid, World::deformable};

}  // namespace

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
