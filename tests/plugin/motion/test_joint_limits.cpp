// Joints at their limits: contacts do not push them beyond, and may move them away.
#include <BulletDynamics/Featherstone/btMultiBodyJointLimitConstraint.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <vector>

#include "motion/articulated_motion.h"
#include "plugin/support/arm.h"
#include "plugin/support/obstacle_worlds.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;
using bullet::ArticulatedMotion;
using Update = bullet::ArticulatedMotion::Update;
using scenes::World;

namespace {

// An arm whose hinges may turn up by a radian, and not down. As a loader of URDF files, it tells
// the links their limits; `are_told`: whether it does.
class LimitedArm {
 public:
  LimitedArm(ObstacleWorld& w, int links, bool are_told = true)
      : world_(static_cast<btMultiBodyDynamicsWorld&>(w.world())),
        arm_(w, links, true, btVector3(0, 0, 0)) {
    for (int i = 0; i < links; ++i) {
      limits_.push_back(std::make_unique<btMultiBodyJointLimitConstraint>(
          &arm_.body(), i, btScalar(0), btScalar(1)));
      world_.addMultiBodyConstraint(limits_.back().get());
      if (are_told) arm_.body().getLink(i).m_jointUpperLimit = 1;
    }
  }
  ~LimitedArm() {
    for (const auto& limit : limits_) world_.removeMultiBodyConstraint(limit.get());
  }
  btMultiBody& body() { return arm_.body(); }
  double lowest_joint() {
    btScalar lowest = 1;
    for (int i = 0; i < body().getNumLinks(); ++i) lowest = std::min(lowest, body().getJointPos(i));
    return lowest;
  }

 private:
  btMultiBodyDynamicsWorld& world_;
  Arm arm_;
  std::vector<std::unique_ptr<btMultiBodyJointLimitConstraint>> limits_;
};

bullet::DenseVector impulse_on_joints(double first, double second) {
  bullet::DenseVector impulse(8);
  impulse[6] = first;
  impulse[7] = second;
  return impulse;
}

}  // namespace

TEST_CASE("a heavy cloth on an arm does not push its joints beyond their limits") {
  const World kind = GENERATE(World::rigid, World::deformable);
  const bool are_told = GENERATE(true, false);
  CAPTURE(kind, are_told);
  ObstacleWorld w(kind, 10, {}, true);
  LimitedArm arm(w, 2, are_told);
  btSoftBody* const cloth = w.add_sheet(9, 0.9, 0.12, 0);
  cloth->setTotalMass(20);
  cloth->m_cfg.kDF = 1;
  cloth->m_cfg.collisions |= btSoftBody::fCollision::SDF_MDF;
  double lowest = 1;
  w.steps(60, 1.0 / 240, [&](int) { lowest = std::min(lowest, arm.lowest_joint()); });
  REQUIRE(w.total().contacts_vf + w.total().contacts_ee > 0);
  if (are_told)
    CHECK(lowest > -0.003);
  else
    CHECK(lowest < -0.006);
}

TEST_CASE("a joint at its limit is pushed away from it by what the application moves") {
  const World kind = GENERATE(World::rigid, World::deformable);
  CAPTURE(kind);
  ObstacleWorld w(kind, 10, {}, true);
  LimitedArm arm(w, 1);
  btSoftBody* const cloth = w.add_sheet(5, 0.2, -0.13, 0);
  cloth->m_cfg.collisions |= btSoftBody::fCollision::SDF_MDF;
  for (int i = 0; i < cloth->m_nodes.size(); ++i) {
    cloth->m_nodes[i].m_x += btVector3(btScalar(0.3), 0, 0);
    cloth->setMass(i, 0);
  }
  w.steps(40, 1.0 / 240, [&](int) {
    for (int i = 0; i < cloth->m_nodes.size(); ++i)
      cloth->m_nodes[i].m_x += btVector3(0, btScalar(0.002), 0);
  });
  CHECK(arm.lowest_joint() > 0.2);
  CHECK(w.total().failsafe_holds == 0);
}

TEST_CASE("a joint at its limit holds against impulses towards it only") {
  ObstacleWorld w(World::deformable, 0);
  LimitedArm arm(w, 2);
  w.steps(1, 1.0 / 240);  // Bullet computes the inertia of the joints
  arm.body().setJointPos(1, btScalar(0.5));
  const bullet::MultibodyPose pose = bullet::pose_of(arm.body());
  ArticulatedMotion motion(arm.body(), pose);
  REQUIRE(motion.holds.size() == 1);
  CHECK(motion.holds[0].coordinate == 6);
  CHECK(motion.holds[0].is_limit);
  CHECK(motion.holds[0].lowest == 0);
  CHECK(motion.inverse_mass.row(6).isZero());
  const double free_mobility = motion.inverse_mass(7, 7);

  motion.impulse = impulse_on_joints(-1, -0.2);
  CHECK(!motion.update_holds(Update::all).any);
  // What the limit exerts stops the first joint, and nothing else.
  const bullet::DenseVector exerted = motion.with_limits(motion.impulse) - motion.impulse;
  CHECK(exerted[6] > 0.5);
  CHECK(exerted[7] == 0);

  motion.impulse = impulse_on_joints(1, 0);
  CHECK(!motion.update_holds(Update::last).any);
  CHECK(motion.update_holds(Update::all).any);
  CHECK(motion.inverse_mass(6, 6) > 0);
  CHECK(motion.inverse_mass(7, 7) > free_mobility);
  CHECK(motion.with_limits(motion.impulse) == motion.impulse);
  motion.restart_response();
  CHECK(motion.inverse_mass(6, 6) > 0);

  // The free joint is held once it is beyond its limit.
  motion.displacement = impulse_on_joints(0.1, -0.1);
  CHECK(!motion.update_holds(Update::all).any);
  motion.displacement = impulse_on_joints(-0.1, 0);
  CHECK(motion.update_holds(Update::all).any);
  CHECK(motion.inverse_mass.row(6).isZero());

  arm.body().setJointPos(0, btScalar(0.5));
  const bullet::MultibodyPose elsewhere = bullet::pose_of(arm.body());
  CHECK(ArticulatedMotion(arm.body(), pose).holds.empty());
  // A joint that comes to its limit in this step is free at first.
  arm.body().setJointPos(0, 0);
  const ArticulatedMotion arrives(arm.body(), elsewhere);
  REQUIRE(arrives.holds.size() == 1);
  CHECK(!arrives.holds[0].holds);
  CHECK(arrives.inverse_mass(6, 6) > 0);
  arm.body().setJointPos(0, btScalar(0.9995));
  const ArticulatedMotion at_upper(arm.body(), bullet::pose_of(arm.body()));
  REQUIRE(at_upper.holds.size() == 1);
  CHECK(at_upper.holds[0].highest == 0);
  CHECK(at_upper.holds[0].holds);

  btMultibodyLink& link = arm.body().getLink(0);
  link.m_jointLowerLimit = -std::numeric_limits<btScalar>::max();
  link.m_jointUpperLimit = std::numeric_limits<btScalar>::max();
  CHECK(ArticulatedMotion(arm.body(), pose).holds.empty());
}

TEST_CASE("an impulse and what limits exert make just the motion of the held body") {
  ObstacleWorld w(World::deformable, 0);
  LimitedArm arm(w, 2);
  w.steps(1, 1.0 / 240);
  arm.body().setJointPos(0, btScalar(0.5));
  const bullet::MultibodyPose pose = bullet::pose_of(arm.body());
  const ArticulatedMotion held(arm.body(), pose);
  REQUIRE(held.holds.size() == 1);
  arm.body().getLink(1).m_jointUpperLimit = 0;  // no limits
  const ArticulatedMotion free(arm.body(), pose);
  REQUIRE(free.holds.empty());
  const bullet::DenseVector impulse = impulse_on_joints(0.7, -0.3);
  const bullet::DenseVector expected = free.inverse_mass * held.with_limits(impulse);
  CHECK((held.inverse_mass * impulse - expected).norm_infinity() < 1e-9 * expected.norm_infinity());
}
