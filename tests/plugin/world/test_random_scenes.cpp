// Random scenes, and tests of faults that such scenes have found.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

#include <algorithm>
#include <limits>

#include "plugin/support/obstacle_worlds.h"
#include "random/random_scene.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::World;

TEST_CASE("nothing passes through anything in random scenes") {
  const World world = GENERATE(World::rigid, World::deformable);
  for (std::uint32_t number = 300; number < 308; ++number) {
    CAPTURE(number);
    const SceneReport report = run_random_scene(number, world);
    INFO(report.what);
    CHECK(report.finite);
    CHECK(report.crossings == 0);
    CHECK(report.intersections == 0);
    const bool caught = report.stats.failsafe_holds + report.stats.unresolved > 0;
    CHECK((caught || report.overlaps == 0));
    CHECK(report.stats.initial_intersections == 0);
    CHECK(report.stats.fallback_steps == 0);
    if (!report.driven) {
      CHECK(report.stats.unresolved == 0);
      CHECK(report.stats.energy_gained <= 1e-9 * (report.stats.energy_lost + 1));
    }
  }
}

TEST_CASE("a random scene starts clean also beyond the triangles of a plane") {
  CHECK(run_random_scene(120108, World::rigid).stats.initial_intersections == 0);
}

TEST_CASE("what is within rounding, far from the origin, is not moved through anything") {
  struct Scene {
    World world;
    std::uint32_t number;
  };
  const Scene scene = GENERATE(Scene{World::rigid, 1400230}, Scene{World::rigid, 1400809},
                               Scene{World::rigid, 1401566}, Scene{World::rigid, 1401677},
                               Scene{World::deformable, 1500712});
  CAPTURE(scene.number);
  const SceneReport report = run_random_scene(scene.number, scene.world);
  CHECK(report.finite);
  CHECK(report.crossings == 0);
  CHECK(report.intersections == 0);
}

TEST_CASE("flat cloth in any pose is not reported to intersect itself") {
  const World world = GENERATE(World::rigid, World::deformable);
  ObstacleWorld w(world, 0);
  btSoftBody* cloth = w.add(scenes::make_cloth(w.info(), 9, 9, 1, [](double u, double v) {
    return btVector3(static_cast<btScalar>(u), 0, static_cast<btScalar>(v));
  }));
  cloth->transform(btTransform(btQuaternion(btVector3(1, 2, 3).normalized(), btScalar(0.7)),
                               btVector3(10, 20, 30)));
  cloth->setSelfCollision(true);
  w.steps(2);
  CHECK(w.total().initial_intersections == 0);
}

TEST_CASE("a mesh that rotates far in one step pushes cloth on the chord") {
  // A wall from `from` to `to` metres from its axis rotates from -`angle` to `angle`. On the
  // straight chord it would pass the cloth, at x = `passes`, at half of the way.
  struct Turn {
    double from, to, angle, passes, width;
  };
  const Turn rotation = GENERATE(Turn{9, 11, 1.05, 4.8, 0.4}, Turn{6.5, 7.5, 1.5, 0.47, 0.04});
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid, rotation.angle);
  ObstacleWorld w(world, 0);
  btSoftBody* cloth = w.add(scenes::make_cloth(w.info(), 4, 4, 1, [&](double u, double v) {
    return btVector3(static_cast<btScalar>(rotation.passes + rotation.width * u),
                     static_cast<btScalar>(rotation.width * (v - 0.5)),
                     static_cast<btScalar>(0.01 * u * v));
  }));
  btTriangleMesh triangles;
  for (int i = 0; i < 4; ++i) {
    for (int k = 0; k < 4; ++k) {
      const auto at = [&](int a, int b) {
        return btVector3(
            static_cast<btScalar>(rotation.from + a * (rotation.to - rotation.from) / 4),
            btScalar(-1) + b * btScalar(0.5), 0);
      };
      triangles.addTriangle(at(i, k), at(i + 1, k), at(i + 1, k + 1));
      triangles.addTriangle(at(i, k), at(i + 1, k + 1), at(i, k + 1));
    }
  }
  btRigidBody* wall =
      w.add(std::make_unique<btBvhTriangleMeshShape>(&triangles, true), btVector3(0, 0, 0));
  ObstacleWorld::make_kinematic(*wall);
  const auto turned = [](double angle) {
    return btTransform(btQuaternion(btVector3(0, 1, 0), static_cast<btScalar>(angle)));
  };
  wall->setWorldTransform(turned(-rotation.angle));
  w.steps(1);
  wall->setWorldTransform(turned(rotation.angle));
  w.steps(1);
  REQUIRE(w.last().contacts_vf > 0);
  CHECK(w.total().unresolved == 0);
  const double least = 0.9 * rotation.from * std::sin(rotation.angle);
  for (int i = 0; i < 16; ++i) CHECK(static_cast<double>(cloth->m_nodes[i].m_x.z()) < -least);
}

TEST_CASE("cloth without a margin keeps a gap that rounding cannot close") {
  const World world = GENERATE(World::rigid, World::deformable);
  ObstacleWorld w(world, 10);
  const btQuaternion tilt(btVector3(1, 0, 1).normalized(), btScalar(0.1));
  btRigidBody* box =
      w.add(std::make_unique<btBoxShape>(btVector3(2, btScalar(0.1), 2)), btVector3(0, 0, 0), 0, 0);
  box->setWorldTransform(btTransform(tilt));
  btSoftBody* cloth = w.add_sheet(6, 1, 0.2, 2);
  cloth->getCollisionShape()->setMargin(0);
  double narrowest = 1;
  w.steps(60, 1.0 / 120, [&](int) {
    for (int i = 0; i < cloth->m_nodes.size(); ++i) {
      const btVector3 local = box->getWorldTransform().invXform(cloth->m_nodes[i].m_x);
      narrowest = std::min(narrowest, static_cast<double>(local.y() - btScalar(0.1)));
    }
  });
  const double rounding = static_cast<double>(std::numeric_limits<btScalar>::epsilon());
  CHECK(narrowest > 2 * rounding);
  CHECK(narrowest < 0.01);
  CHECK(w.total().failsafe_holds == 0);
}

TEST_CASE("a rigid body that Bullet pushes out of another adds no energy to cloth") {
  // The body moves without having a velocity, and cloth is in its way.
  const World world = GENERATE(World::rigid, World::deformable);
  ObstacleWorld w(world, 0);
  w.add(std::make_unique<btStaticPlaneShape>(btVector3(0, 1, 0), btScalar(0)), btVector3(0, 0, 0));
  w.add(std::make_unique<btSphereShape>(btScalar(0.5)), btVector3(0, btScalar(-0.2), 0), 2);
  btSoftBody* sheet = w.add_sheet(6, 1, 0.35, 0);
  w.steps(20);
  REQUIRE(w.total().contacts_vf > 0);
  CHECK(w.total().energy_gained < 1e-9);
  CHECK(static_cast<double>(sheet->m_nodes[14].m_x.y()) > 0.35);
}
