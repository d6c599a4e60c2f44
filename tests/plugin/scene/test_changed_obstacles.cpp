// Obstacles that an application changes while soft bodies are near, asleep, or gone.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "plugin/support/obstacle_worlds.h"
#include "scene/obstacles.h"
#include "scenes/meshes/cloth.h"
#include "scenes/meshes/shapes.h"
#include "shapes/tessellation.h"
#include "support/catch.h"
#include "util/warning_log.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::vector;
using scenes::World;

namespace {

// A cloth of 1 m that is held at its corners.
btSoftBody* add_hanging(ObstacleWorld& w) {
  constexpr int nodes = 13;
  btSoftBody* const cloth = w.add(scenes::make_cloth(
      w.info(), nodes, nodes, 0.5, [](double u, double v) { return vector(u - 0.5, 0, v - 0.5); }));
  for (const int corner : {0, nodes - 1, nodes * (nodes - 1), nodes * nodes - 1})
    scenes::pin(*cloth, corner, corner);
  return cloth;
}

// Nodes inside of a box with this centre and half size.
int count_inside(const btSoftBody& body, const btVector3& centre, const btVector3& half) {
  int count = 0;
  for (int i = 0; i < body.m_nodes.size(); ++i) {
    const btVector3 x = (body.m_nodes[i].m_x - centre).absolute();
    count += x.x() < half.x() && x.y() < half.y() && x.z() < half.z();
  }
  return count;
}

int count_above(const btSoftBody& body, double height) {
  int count = 0;
  for (int i = 0; i < body.m_nodes.size(); ++i)
    count += static_cast<double>(body.m_nodes[i].m_x.y()) > height;
  return count;
}

}  // namespace

TEST_CASE("a child of a compound that moves takes cloth along") {
  const World world = GENERATE(World::rigid, World::deformable);
  const double speed = GENERATE(0.1, 0.6, 3.0);
  const bool is_cut = GENERATE(false, true);  // only children near the cloth are read
  CAPTURE(world == World::rigid, speed, is_cut);
  ObstacleWorld w(world, 10);
  btBoxShape box(vector(0.3, 0.1, 0.3));
  auto owned = std::make_unique<btCompoundShape>();
  btCompoundShape* const compound = owned.get();
  const auto place = [](double height) {
    return btTransform(btQuaternion::getIdentity(), vector(0.02, height, 0.01));
  };
  compound->addChildShape(place(-0.7), &box);
  for (int i = 0; is_cut && i < 40; ++i) compound->addChildShape(place(-20 - i), &box);
  w.add(std::move(owned), vector(0, 0, 0));
  btSoftBody* const cloth = add_hanging(w);
  w.steps(60, 1.0 / 60);
  double height = -0.7;
  while (height < -0.1) {
    height += speed / 60;
    compound->updateChildTransform(0, place(height));
    w.steps(1, 1.0 / 60);
  }
  w.steps(30, 1.0 / 60);
  CHECK(count_inside(*cloth, vector(0.02, height, 0.01), vector(0.29, 0.09, 0.29)) == 0);
  CHECK(count_above(*cloth, height + 0.1) > 30);
  CHECK(w.total().initial_intersections == 0);
}

TEST_CASE("what an obstacle grows into comes out of it") {
  const World world = GENERATE(World::rigid, World::deformable);
  const std::string change = GENERATE("scaling", "shape", "ignored");
  CAPTURE(world == World::rigid, change);
  ObstacleWorld w(world, 10);
  const btVector3 half = vector(0.2, 0.15, 0.2);
  btBoxShape large(half);
  const bool starts_large = change == "ignored";
  btRigidBody* const box =
      w.add(std::make_unique<btBoxShape>(starts_large ? half : vector(0.2, 0.05, 0.2)),
            vector(0, -0.4, 0));
  btSoftBody* const cloth = add_hanging(w);
  if (starts_large) box->setIgnoreCollisionCheck(cloth, true);
  w.steps(60, 1.0 / 60);
  if (change == "scaling") box->getCollisionShape()->setLocalScaling(vector(1, 3, 1));
  if (change == "shape") box->setCollisionShape(&large);
  if (change == "ignored") box->setIgnoreCollisionCheck(cloth, false);
  w.steps(180, 1.0 / 60);
  CHECK(count_inside(*cloth, vector(0, -0.4, 0), half - vector(0.01, 0.01, 0.01)) == 0);
}

TEST_CASE("a body that is put into a sleeping cloth wakes it, and the cloth comes out") {
  const World world = GENERATE(World::rigid, World::deformable);
  const std::string how = GENERATE("moved", "teleported", "added");
  CAPTURE(world == World::rigid, how);
  ObstacleWorld w(world, 0);
  btSoftBody* const cloth = add_hanging(w);
  const btVector3 half = vector(0.2, 0.2, 0.2);
  btRigidBody* box =
      how == "added" ? nullptr : w.add(std::make_unique<btBoxShape>(half), vector(0, 3, 0));
  w.steps(5);
  cloth->forceActivationState(ISLAND_SLEEPING);
  for (int i = 0; i < cloth->m_nodes.size(); ++i) cloth->m_nodes[i].m_v.setZero();
  w.steps(20);
  REQUIRE(w.last().sleeping_bodies == 1);
  if (box)
    box->setWorldTransform(btTransform(btQuaternion::getIdentity(), vector(0.01, 0, 0.02)));
  else
    w.add(std::make_unique<btBoxShape>(half), vector(0.01, 0, 0.02));
  if (how == "teleported") w.teleported(*box);
  w.steps(240, 1.0 / 60);
  CHECK(count_inside(*cloth, vector(0.01, 0, 0.02), half - vector(0.01, 0.01, 0.01)) == 0);
}

TEST_CASE("a plane's margin and a hull's points count from the next step on") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 10);
  btRigidBody* const plane =
      w.add(std::make_unique<btStaticPlaneShape>(btVector3(0, 1, 0), 0), vector(0, 0, 0));
  auto owned = std::make_unique<btConvexHullShape>();
  btConvexHullShape* const hull = owned.get();
  for (const auto& x : {vector(-1, 0, -1), vector(1, 0, -1), vector(-1, 0, 1), vector(-1, 0.5, -1),
                        vector(1, 0.5, -1), vector(-1, 0.5, 1)})
    hull->addPoint(x);
  w.add(std::move(owned), vector(5, 0, 0));
  btSoftBody* const on_plane = w.add_sheet(5, 0.5, 0.4, 0);
  btSoftBody* const on_hull = w.add_sheet(5, 0.3, 1, 0);
  on_hull->translate(vector(5.75, 0, 0.75));
  w.steps(2, 1.0 / 120);
  plane->getCollisionShape()->setMargin(btScalar(0.08));
  hull->addPoint(vector(1, 0, 1));
  hull->addPoint(vector(1, 0.5, 1));
  w.steps(120, 1.0 / 120);
  CHECK(count_above(*on_plane, 0.06) == 25);
  CHECK(count_above(*on_hull, 0.5) == 25);
}

TEST_CASE("an overlap filter that an application removes no longer rules") {
  struct Never : btOverlapFilterCallback {
    bool needBroadphaseCollision(btBroadphaseProxy*, btBroadphaseProxy*) const override {
      return false;
    }
  };
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 10);
  w.add(std::make_unique<btBoxShape>(vector(1, 0.5, 1)), vector(0, -0.5, 0));
  btSoftBody* const lower = w.add_sheet(5, 1, 0.2, 0);
  btSoftBody* const upper = w.add_sheet(5, 0.8, 0.4, 0);
  Never never;
  btOverlappingPairCache* const pairs = w.world().getPairCache();
  pairs->setOverlapFilterCallback(&never);
  w.steps(3, 1.0 / 120);
  pairs->setOverlapFilterCallback(nullptr);
  w.steps(120, 1.0 / 120);
  CHECK(count_above(*lower, 0) == 25);
  CHECK(count_above(*upper, 0) == 25);
}

TEST_CASE("obstacles are forgotten where no soft body is any more") {
  ObstacleWorld w(World::rigid, 0);
  for (int i = 0; i < 30; ++i)
    w.add(std::make_unique<btBoxShape>(vector(0.4, 0.4, 0.4)), vector(i, 0, 0));
  btSoftBody* const cloth = w.add_sheet(3, 1, 0, 0);
  w.world().updateAabbs();
  btAlignedObjectArray<btSoftBody*> bodies;
  bodies.push_back(cloth);
  bullet::Obstacles obstacles(5);
  bullet::WarningLog warnings(nullptr);
  const auto near = [&](double farthest) {
    obstacles.begin_step(bodies);
    obstacles.read_poses(bodies, 1, warnings);
    bullet::AxisBox swept = bullet::AxisBox::empty();
    swept.add(vector(-0.5, -0.1, -0.5));
    swept.add(vector(farthest, 0.1, 0.5));
    if (obstacles.update(bodies, {swept}, 1e-3, warnings))
      obstacles.read_triangles({swept}, warnings);
    CHECK(obstacles.has_read({swept}));
    return obstacles.records().size();
  };
  const std::size_t before = near(0.5);
  CHECK(before < 4);
  CHECK(near(40) == 30);
  CHECK(near(0.5) == before);
}

TEST_CASE("of a compound with many children only those in the region are read") {
  btBoxShape box(vector(0.4, 0.4, 0.4));
  btCompoundShape compound;
  for (int i = 0; i < 100; ++i)
    compound.addChildShape(btTransform(btQuaternion::getIdentity(), vector(i, 0, 0)), &box);
  REQUIRE(bullet::is_cut_to_region(compound));
  bullet::AxisBox region = bullet::AxisBox::empty();
  region.add(vector(9.9, 0, 0));
  region.add(vector(12.1, 0, 0));
  bullet::Triangles triangles;
  CHECK(bullet::tessellate(compound, btTransform::getIdentity(), region, region, 1e-3, triangles));
  CHECK(triangles.faces.size() == 3 * 12);
}
