// Bodies that the application puts elsewhere, and bodies that it moves.
#include <BulletCollision/CollisionShapes/btBoxShape.h>

#include <algorithm>
#include <string>

#include "motion/rigid_displacement.h"
#include "plugin/support/obstacle_worlds.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::World;

namespace {

struct Table {
  ObstacleWorld w;
  btSoftBody* cloth;
  btRigidBody* box;

  Table(World world, const std::string& kind, double height)
      : w(world, 0), cloth(w.add_sheet(13, 2, 0, 0)) {
    scenes::pin_border(*cloth, 13, 13);
    const btVector3 half(btScalar(0.3), btScalar(0.2), btScalar(0.3));
    box = w.add(std::make_unique<btBoxShape>(half), btVector3(0, static_cast<btScalar>(height), 0),
                kind == "dynamic" ? 1 : 0);
    if (kind == "kinematic") ObstacleWorld::make_kinematic(*box);
  }
  void put(double height) {
    btTransform pose = box->getWorldTransform();
    pose.getOrigin().setY(static_cast<btScalar>(height));
    box->setWorldTransform(pose);
    box->setInterpolationWorldTransform(pose);
  }
  double fastest() const {
    btScalar fastest = 0;
    for (int i = 0; i < cloth->m_nodes.size(); ++i)
      fastest = std::max(fastest, cloth->m_nodes[i].m_v.length());
    return static_cast<double>(fastest);
  }
  double middle() const {
    return static_cast<double>(cloth->m_nodes[cloth->m_nodes.size() / 2].m_x.y());
  }
};

}  // namespace

TEST_CASE("a body that is put on the other side of a cloth does not push it") {
  const World world = GENERATE(World::rigid, World::deformable);
  const std::string kind = GENERATE("dynamic", "kinematic", "static");
  CAPTURE(world == World::rigid, kind);
  Table table(world, kind, 2);
  table.w.steps(4, 1.0 / 60);
  table.put(-2);
  table.w.steps(4, 1.0 / 60);
  CHECK(table.fastest() < 0.1);
}

TEST_CASE("a cloth that is put into another one is reported, whether the solver is told or not") {
  const World world = GENERATE(World::rigid, World::deformable);
  const bool is_told = GENERATE(false, true);
  CAPTURE(world == World::rigid, is_told);
  ObstacleWorld w(world, 0);
  w.add_sheet(9, 1, 0, 0);
  btSoftBody* const other = w.add_sheet(9, 1, 1, 0);
  w.steps(2);
  other->rotate(btQuaternion(btVector3(0, 0, 1), btScalar(0.7)));
  other->translate(btVector3(btScalar(0.1), btScalar(-1), 0) -
                   btVector3(other->m_nodes[40].m_x.x(), 0, 0));
  if (is_told) w.teleported(*other);
  w.steps(1);
  CHECK(w.last().initial_intersections > 0);
}

TEST_CASE("a body that is driven pushes cloth, whether its velocity is set or not") {
  const World world = GENERATE(World::rigid, World::deformable);
  const std::string kind = GENERATE("kinematic", "static");
  const double speed = GENERATE(1.0, 20.0);
  CAPTURE(world == World::rigid, kind, speed);
  Table table(world, kind, 1);
  const int count = static_cast<int>(1.1 / speed * 240);
  table.w.steps(count, 1.0 / 240, [&](int i) {
    btTransform pose = table.box->getWorldTransform();
    pose.getOrigin().setY(static_cast<btScalar>(1 - speed * i / 240));
    table.box->setWorldTransform(pose);
  });
  CHECK(table.middle() < -0.05);
  CHECK(table.middle() <
        static_cast<double>(table.box->getWorldTransform().getOrigin().y()) - 0.19);
}

TEST_CASE("cloth that a body is put into lets it out without a throw") {
  const World world = GENERATE(World::rigid, World::deformable);
  const std::string kind = GENERATE("dynamic", "static");
  CAPTURE(world == World::rigid, kind);
  Table table(world, kind, 2);
  table.w.steps(4, 1.0 / 60);
  table.put(0.15);
  table.w.steps(120, 1.0 / 60);
  CHECK(table.middle() <
        static_cast<double>(table.box->getWorldTransform().getOrigin().y()) - 0.199);
}

TEST_CASE("velocity, drive and size explain a displacement") {
  ObstacleWorld w(World::rigid, 0);
  const btVector3 half(1, 1, 1);
  btRigidBody& wall = *w.add(std::make_unique<btBoxShape>(half), btVector3(0, 0, 0));
  btRigidBody& ball = *w.add(std::make_unique<btBoxShape>(half), btVector3(0, 5, 0), 1);
  const auto at = [](double x) {
    return btTransform(btQuaternion::getIdentity(), btVector3(static_cast<btScalar>(x), 0, 0));
  };
  const btScalar dt = btScalar(0.01), speed = 5;
  CHECK_FALSE(bullet::is_jump(wall, {at(0), at(0), at(0.04)}, dt, speed));
  CHECK(bullet::is_jump(wall, {at(0), at(0), at(0.06)}, dt, speed));
  CHECK_FALSE(bullet::is_jump(wall, {at(0), at(1), at(2)}, dt, speed));
  CHECK(bullet::is_jump(wall, {at(0), at(1), at(4)}, dt, speed));
  wall.setLinearVelocity(btVector3(100, 0, 0));
  CHECK_FALSE(bullet::is_jump(wall, {at(0), at(0), at(4)}, dt, speed));  // four substeps at once
  ball.setLinearVelocity(btVector3(100, 0, 0));
  CHECK_FALSE(bullet::is_jump(ball, {at(0), at(0), at(1)}, dt, speed));
  CHECK(bullet::is_jump(ball, {at(0), at(0), at(4)}, dt, speed));
}
