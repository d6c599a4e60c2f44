// Bodies that sleep are left out of a step, and take part again when something awake comes near.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>

#include <algorithm>

#include "plugin/support/obstacle_worlds.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::World;

namespace {

constexpr int steps_to_leave = 12;  // after these steps what sleeps alone is left out

btSoftBody* add_cloth(ObstacleWorld& w, double x, double y) {
  const auto scalar = [](double value) { return static_cast<btScalar>(value); };
  return w.add(scenes::make_cloth(w.info(), 6, 6, 1, [&](double u, double v) {
    return btVector3(scalar(x + 0.5 * u), scalar(y + 1e-3 * u * v), scalar(0.5 * v));
  }));
}

btSoftBody* add_sleeper(ObstacleWorld& w, double x, double y) {
  btSoftBody* const cloth = add_cloth(w, x, y);
  cloth->forceActivationState(ISLAND_SLEEPING);
  return cloth;
}

double mean_height(const btSoftBody& body) {
  double sum = 0;
  for (int i = 0; i < body.m_nodes.size(); ++i) sum += static_cast<double>(body.m_nodes[i].m_x.y());
  return sum / body.m_nodes.size();
}

double lowest_of(const btSoftBody& body) {
  btScalar y = BT_LARGE_FLOAT;
  for (int i = 0; i < body.m_nodes.size(); ++i) y = std::min(y, body.m_nodes[i].m_x.y());
  return static_cast<double>(y);
}

double highest_of(const btSoftBody& body) {
  btScalar y = -BT_LARGE_FLOAT;
  for (int i = 0; i < body.m_nodes.size(); ++i) y = std::max(y, body.m_nodes[i].m_x.y());
  return static_cast<double>(y);
}

}  // namespace

TEST_CASE("sleepers are left out until something awake comes near, however fast") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 0);
  std::vector<btSoftBody*> sleepers;
  for (int i = 0; i < 5; ++i) sleepers.push_back(add_sleeper(w, 2 * i, 0));
  btSoftBody* const thrown = add_cloth(w, 4, 5);
  w.steps(steps_to_leave);
  CHECK(w.last().soft_bodies == 1);
  CHECK(w.last().sleeping_bodies == 5);
  thrown->setVelocity(btVector3(0, -100, 0));
  w.steps(24);
  for (int i = 0; i < 5; ++i) CHECK(sleepers[i]->isActive() == (i == 2));
  CHECK(lowest_of(*thrown) > highest_of(*sleepers[2]) - 0.2);
  CHECK(highest_of(*sleepers[2]) < -0.5);
  CHECK(w.last().soft_bodies == 2);
  CHECK(w.last().sleeping_bodies == 4);
}

TEST_CASE("a sleeper behind a sleeper that is hit takes part in the same step") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 0);
  btSoftBody* const hit = add_sleeper(w, 0, 0);
  btSoftBody* const behind = add_sleeper(w, 0, -0.5);
  btSoftBody* const thrown = add_cloth(w, 0, 5);
  w.steps(steps_to_leave);
  REQUIRE(w.last().soft_bodies == 1);
  thrown->setVelocity(btVector3(0, -100, 0));
  for (int i = 0; i < 10; ++i) {
    w.steps(1, 1.0 / 60);
    CHECK(mean_height(*thrown) > mean_height(*hit));
    CHECK(mean_height(*hit) > mean_height(*behind));
  }
  CHECK(behind->isActive());
  CHECK(w.total().unresolved == 0);
}

TEST_CASE("a kinematic body that starts to move pushes a sleeper") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 0);
  btRigidBody* const plate =
      w.add(std::make_unique<btBoxShape>(btVector3(2, btScalar(0.1), 2)), btVector3(0, 1, 0));
  ObstacleWorld::make_kinematic(*plate);
  btSoftBody* const sleeper = add_sleeper(w, 0, 0);
  add_cloth(w, 10, 0);
  w.steps(steps_to_leave);
  REQUIRE(w.last().sleeping_bodies == 1);
  w.steps(30, 1.0 / 60, [&](int i) {
    btTransform pose = plate->getWorldTransform();
    pose.getOrigin().setY(1 - btScalar(0.15) * static_cast<btScalar>(i));
    plate->setWorldTransform(pose);
    plate->setInterpolationWorldTransform(pose);
  });
  CHECK(sleeper->isActive());
  CHECK(highest_of(*sleeper) < static_cast<double>(plate->getWorldTransform().getOrigin().y()));
}

TEST_CASE("a rigid body that is thrown at a sleeper does not pass through") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 0);
  btSoftBody* const sleeper = add_sleeper(w, 0, 0);
  btRigidBody* const ball = w.add(std::make_unique<btSphereShape>(btScalar(0.1)),
                                  btVector3(btScalar(0.25), 5, btScalar(0.25)), 1);
  w.steps(steps_to_leave);
  REQUIRE(w.last().sleeping_bodies == 1);
  ball->activate(true);
  ball->setLinearVelocity(btVector3(0, -200, 0));
  w.steps(12);
  CHECK(sleeper->isActive());
  CHECK(static_cast<double>(ball->getWorldTransform().getOrigin().y()) > lowest_of(*sleeper));
}

TEST_CASE("a sleeper that the application moves takes part at its new place") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 0);
  btSoftBody* const sleeper = add_sleeper(w, 0, 0);
  btSoftBody* const thrown = add_cloth(w, 10, 5);
  w.steps(steps_to_leave);
  REQUIRE(w.last().sleeping_bodies == 1);
  sleeper->translate(btVector3(10, 0, 0));
  w.steps(steps_to_leave);
  REQUIRE(w.last().sleeping_bodies == 1);
  thrown->setVelocity(btVector3(0, -100, 0));
  w.steps(24);
  CHECK(sleeper->isActive());
  CHECK(lowest_of(*thrown) > highest_of(*sleeper) - 0.2);
}

TEST_CASE("a body that a solver callback removes is forgotten in the middle of the step") {
  static ObstacleWorld* world = nullptr;
  static btSoftBody* removed = nullptr;
  static int calls = 0;
  ObstacleWorld w(World::deformable, 10);
  world = &w;
  calls = 0;
  removed = add_cloth(w, 0, 0.5);
  btSoftBody* const kept = add_cloth(w, 0, 1);
  // Bullet calls it before and after it has solved the step.
  auto& deformables = static_cast<btDeformableMultiBodyDynamicsWorld&>(w.world());
  deformables.setSolverCallback([](btScalar, btDeformableMultiBodyDynamicsWorld*) {
    if (++calls == 4) world->remove(removed);
  });
  w.steps(4);
  CHECK(calls > 4);
  CHECK(w.total().fallback_steps == 0);
  CHECK((kept->m_cfg.collisions & btSoftBody::fCollision::VF_DD) != 0);
}

TEST_CASE("a deformable that rests on a box falls asleep at Bullet's threshold") {
  const double dt = GENERATE(1.0 / 240, 1.0 / 60);
  CAPTURE(dt);
  ObstacleWorld w(World::deformable, 10);
  w.add(std::make_unique<btBoxShape>(btVector3(20, 1, 20)), btVector3(0, -1, 0));
  btSoftBody* const cloth = add_cloth(w, 0, 0.02);
  cloth->m_sleepingThreshold = btScalar(0.04);  // Bullet's default, m/s
  cloth->forceActivationState(ACTIVE_TAG);
  w.steps(static_cast<int>(6 / dt), dt);
  CHECK(w.total().contacts_vf > 0);
  CHECK(!cloth->isActive());
}

TEST_CASE("a sleeper is not woken by what passes near it nor by its own contacts") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 10);
  w.add(std::make_unique<btBoxShape>(btVector3(20, 1, 20)), btVector3(0, -1, 0));
  btSoftBody* const sleeper = add_cloth(w, 0, 0.02);
  w.steps(240);
  // The gap is 1.5 times the thickness of contacts.
  const btScalar height = static_cast<btScalar>(highest_of(*sleeper) + 0.03 + 0.1);
  btRigidBody* const plate =
      w.add(std::make_unique<btBoxShape>(btVector3(1, btScalar(0.1), 1)), btVector3(-3, height, 0));
  ObstacleWorld::make_kinematic(*plate);
  sleeper->forceActivationState(ISLAND_SLEEPING);
  const btVector3 before = sleeper->m_nodes[7].m_x;
  std::int64_t took_part = 0;
  w.steps(60, 1.0 / 60, [&](int i) {
    took_part += i > steps_to_leave ? w.last().soft_bodies : 0;
    btTransform pose = plate->getWorldTransform();
    pose.getOrigin().setX(-3 + btScalar(0.1) * static_cast<btScalar>(i));
    plate->setWorldTransform(pose);
    plate->setInterpolationWorldTransform(pose);
  });
  CHECK(took_part > 0);
  CHECK(took_part < 40);
  CHECK(!sleeper->isActive());
  CHECK((sleeper->m_nodes[7].m_x - before).length() < btScalar(1e-4));
}

TEST_CASE("contact lists of a sleeper stay, and bodies may go while others sleep") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 10);
  btRigidBody* const floor =
      w.add(std::make_unique<btBoxShape>(btVector3(20, 1, 20)), btVector3(0, -1, 0));
  btSoftBody* const first = add_cloth(w, 0, 0.02);
  btSoftBody* const second = add_cloth(w, 2, 0.02);
  btSoftBody* const third = add_cloth(w, 4, 0.02);
  w.steps(120);
  const auto listed = [](const btSoftBody& body) {
    return body.m_rcontacts.size() + body.m_nodeRigidContacts.size();
  };
  REQUIRE(listed(*second) > 0);
  for (btSoftBody* const body : {first, second}) body->forceActivationState(ISLAND_SLEEPING);
  w.steps(steps_to_leave);
  REQUIRE(w.last().sleeping_bodies == 2);
  const int count = listed(*second);
  CHECK(count > 0);
  w.remove(first);
  w.steps(2);
  CHECK(w.last().sleeping_bodies == 1);
  CHECK(listed(*second) == count);
  w.remove(floor);
  w.steps(steps_to_leave);
  CHECK(!second->isActive());
  CHECK(lowest_of(*third) < lowest_of(*second));
  second->activate(true);
  w.steps(24);
  CHECK(lowest_of(*second) < -0.01);
  w.remove(second);
  w.remove(third);
  w.steps(2);
  CHECK(w.last().soft_bodies == 0);
}
