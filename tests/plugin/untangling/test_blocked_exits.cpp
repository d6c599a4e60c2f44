// What starts inside of a body does not leave it where something else is in the way.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

#include <algorithm>
#include <string>

#include "plugin/support/obstacle_worlds.h"
#include "plugin/support/soft_body_figures.h"
#include "scenes/meshes/shapes.h"
#include "support/catch.h"
#include "support/test_budget.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::vector;
using scenes::World;

namespace {

btSoftBody* add_carpet(ObstacleWorld& w, double height) {
  btSoftBody* const carpet = w.add(
      scenes::make_cloth(w.info(), 15, 15, 1,
                         [&](double u, double v) { return vector(2 * u - 1, height, 2 * v - 1); }),
      0.03);
  carpet->m_cfg.kDF = btScalar(0.5);
  return carpet;
}

btRigidBody* add_floor(ObstacleWorld& w, const std::string& kind, btTriangleMesh& triangles) {
  if (kind == "plane")
    return w.add(std::make_unique<btStaticPlaneShape>(vector(0, 1, 0), 0), vector(0, 0, 0));
  if (kind == "mesh")
    return w.add(std::make_unique<btBvhTriangleMeshShape>(&triangles, true), vector(0, 0, 0));
  return w.add(std::make_unique<btBoxShape>(vector(20, 1, 20)), vector(0, -1, 0));
}

// Runs four seconds. Returns the largest speed.
double run(ObstacleWorld& w, const btSoftBody& body) {
  double fastest = 0;
  w.steps(240, 1.0 / 60, [&](int) { fastest = std::max(fastest, speed(body)); });
  return fastest;
}

}  // namespace

TEST_CASE("a carpet through which furniture stands on the floor is not torn") {
  const World world = GENERATE(World::rigid, World::deformable);
  const std::string floor = GENERATE(sweep({"box", "plane", "mesh"}));
  const double half = GENERATE(0.05, 0.4);             // a leg, or a chest
  const double height = GENERATE(sweep({0.03, 0.1}));  // of the carpet
  CAPTURE(world == World::rigid, floor, half, height);
  ObstacleWorld w(world, 10);
  const auto triangles = flat_triangles(8, 10);
  add_floor(w, floor, *triangles);
  w.add(std::make_unique<btBoxShape>(vector(half, 0.4, half)), vector(0.02, 0.4, 0.03));
  const btSoftBody* const carpet = add_carpet(w, height);
  CHECK(run(w, *carpet) < 8);
  CHECK(w.total().initial_intersections > 0);
  CHECK(strain(*carpet) < 3);
  const double before = speed(*carpet);
  CHECK(before < (world == World::rigid ? 0.3 : 1.5));
  CHECK(w.total().failsafe_holds == 0);
}

TEST_CASE("a carpet that a long pole pierces stays") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 0);
  w.add(std::make_unique<btBoxShape>(vector(0.05, 2, 0.05)), vector(0.02, 0, 0.03));
  const btSoftBody* const carpet = add_carpet(w, 0.1);
  CHECK(run(w, *carpet) < 1);
  CHECK(strain(*carpet) < 1.5);
}

TEST_CASE("a cloth near the seam of two tiles comes out at the top") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 10);
  for (const double side : {-1, 1})
    w.add(std::make_unique<btBoxShape>(vector(5, 5, 5)), vector(5 * side, -5, 0));
  const btSoftBody* const cloth =
      w.add(scenes::make_cloth(w.info(), 9, 9, 1, [](double u, double v) {
        return vector(0.3 * u + 0.02, 0.5 * v - 0.4, 0.05 * u);
      }));
  w.steps(480);
  for (int i = 0; i < cloth->m_nodes.size(); ++i) CHECK(cloth->m_nodes[i].m_x.y() > 0);
}
