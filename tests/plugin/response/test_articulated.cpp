// Multibodies: their links give way to contacts as their joints let them.
#include "motion/articulated_motion.h"
#include "plugin/support/arm.h"
#include "plugin/support/obstacle_worlds.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::World;

TEST_CASE("a multibody and a cloth keep their momentum when they meet") {
  ObstacleWorld w(World::deformable, 0);
  btSoftBody* const cloth = w.add_sheet(9, 1, 0, 0);
  cloth->m_cfg.kDP = 0;
  cloth->m_cfg.collisions |= btSoftBody::fCollision::SDF_MDF;
  Arm arm(w, 2, false, btVector3(btScalar(-0.3), btScalar(0.2), 0));
  arm.body().setBaseVel(btVector3(0, -3, 0));
  const auto total = [&] {
    btVector3 sum = arm.momentum();
    for (int i = 0; i < cloth->m_nodes.size(); ++i)
      sum += cloth->m_nodes[i].m_v / cloth->m_nodes[i].m_im;
    return sum;
  };
  w.steps(1, 1.0 / 240);
  const btVector3 before = total();
  w.steps(60, 1.0 / 240);
  REQUIRE(w.total().contacts_vf + w.total().contacts_ee > 0);
  CHECK(w.total().failsafe_holds == 0);
  CHECK(arm.momentum().distance(before) > btScalar(0.1));  // the cloth took a part
  CHECK(total().distance(before) < btScalar(0.01) * before.length());
}

TEST_CASE("a link that falls on a pinned cloth stays above it and gains no energy") {
  ObstacleWorld w(World::deformable, 10);
  btSoftBody* const cloth = w.add_sheet(13, 2, 0, 0);
  scenes::pin(*cloth, 0, cloth->m_nodes.size() - 1);
  Arm arm(w, 3, false, btVector3(btScalar(-0.4), btScalar(0.3), 0));
  double fastest = 0;
  w.steps(240, 1.0 / 240, [&](int) {
    fastest = std::max(fastest, static_cast<double>(arm.body().getBaseVel().length()));
  });
  for (int i = -1; i < 3; ++i) CHECK(arm.link(i).getWorldTransform().getOrigin().y() > -1);
  CHECK(fastest < 3.5);  // of a fall by 0.6 m
  CHECK(w.total().energy_gained < 1e-6);
}

TEST_CASE("only links that a joint or a free base moves give way") {
  ObstacleWorld w(World::deformable, 0);
  Arm fixed(w, 1, true, btVector3(0, 0, 0)), free(w, 1, false, btVector3(0, 2, 0));
  CHECK_FALSE(bullet::is_moved(fixed.body(), -1));
  CHECK(bullet::is_moved(fixed.body(), 0));
  CHECK(bullet::is_moved(free.body(), -1));
}

TEST_CASE("a multibody gets the pose that its own integration gives") {
  ObstacleWorld w(World::deformable, 0);
  Arm arm(w, 3, false, btVector3(0, 0, 0));
  const bullet::MultibodyPose start = bullet::pose_of(arm.body());
  const std::vector<double> moved = {0, 0, 0.1, 0.2, 0, 0, 0.3, -0.2, 0.1};
  const bullet::DenseVector displacement(moved.begin(), moved.end());
  bullet::set_pose(arm.body(), start, displacement);
  CHECK_THAT(static_cast<double>(arm.body().getJointPos(1)), Matchers::WithinAbs(-0.2, 1e-6));
  CHECK_THAT(static_cast<double>(arm.link(-1).getWorldTransform().getOrigin().x()),
             Matchers::WithinAbs(0.2, 1e-6));
  bullet::set_pose(arm.body(), start);
  CHECK_THAT(static_cast<double>(arm.link(2).getWorldTransform().getOrigin().x()),
             Matchers::WithinAbs(0.9, 1e-6));
}
