// Pinned nodes inside of bodies that nothing moves count as anchored to them.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

#include <algorithm>
#include <functional>
#include <string>

#include "plugin/support/obstacle_worlds.h"
#include "plugin/support/soft_body_figures.h"
#include "scenes/meshes/shapes.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::vector;
using scenes::World;

namespace {

constexpr int columns = 5;
constexpr double height = 3;  // of the pinned row

// A curtain of 1 kg. Its upper row lies in the axis of a rail, and is pinned there.
btSoftBody* add_curtain(ObstacleWorld& w) {
  auto curtain = scenes::make_cloth(w.info(), columns, 5, 1, [](double u, double v) {
    return vector(2 * u - 1, height - 2 * v, 0);
  });
  for (int i = 0; i < columns; ++i) curtain->setMass(i, 0);
  return w.add(std::move(curtain));
}

// A closed mesh: a bar along x, or the walls of a room of this size if it points inwards.
std::unique_ptr<btTriangleMesh> box_triangles(const btVector3& half, bool inwards) {
  auto mesh = std::make_unique<btTriangleMesh>();
  const auto corner = [&](int i) {
    return half * vector(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
  };
  const int sides[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 4, 6, 2},
                           {1, 3, 7, 5}, {2, 6, 7, 3}, {0, 1, 5, 4}};
  for (const auto& side : sides) {
    for (const int first : {0, 2}) {
      const int a = side[first], b = side[first + 1], c = side[(first + 2) % 4];
      mesh->addTriangle(corner(a), corner(inwards ? c : b), corner(inwards ? b : c));
    }
  }
  return mesh;
}

// Puts the pinned row elsewhere, as an application drives it.
void shift_row(btSoftBody& curtain, const btVector3& by) {
  for (int i = 0; i < columns; ++i) curtain.m_nodes[i].m_x += by;
}

// Largest speed in so many steps.
double speed_in(ObstacleWorld& w, const btSoftBody& body, int steps,
                const std::function<void(int)>& before = {}) {
  double fastest = 0;
  w.steps(steps, 1.0 / 240, [&](int i) {
    fastest = std::max(fastest, speed(body));
    if (before) before(i);
  });
  return fastest;
}

}  // namespace

TEST_CASE("a curtain that is pinned inside of its rail hangs at rest") {
  const World world = GENERATE(World::rigid, World::deformable);
  const std::string rail = GENERATE("box", "cylinder", "capsule", "mesh", "kinematic box");
  const double radius = GENERATE(0.05, 0.2);
  CAPTURE(world == World::rigid, rail, radius);
  ObstacleWorld w(world, 10);
  const auto mesh = box_triangles(vector(1.2, radius, radius), false);
  const btVector3 half = vector(1.2, radius, radius), at = vector(0, height, 0);
  std::unique_ptr<btCollisionShape> shape = std::make_unique<btBoxShape>(half);
  if (rail == "cylinder") shape = std::make_unique<btCylinderShapeX>(half);
  if (rail == "capsule")
    shape = std::make_unique<btCapsuleShapeX>(static_cast<btScalar>(radius), btScalar(2.4));
  if (rail == "mesh") shape = std::make_unique<btBvhTriangleMeshShape>(mesh.get(), true);
  btRigidBody* const body = w.add(std::move(shape), at);
  if (rail == "kinematic box") ObstacleWorld::make_kinematic(*body);
  const btSoftBody* const curtain = add_curtain(w);
  CHECK(speed_in(w, *curtain, 480) < (world == World::rigid ? 1 : 4));
  CHECK(strain(*curtain) < (world == World::rigid ? 1.1 : 3));
  CHECK(w.total().initial_intersections == 0);
  CHECK(w.total().failsafe_holds == 0);
  for (int i = 0; i < columns; ++i) CHECK(curtain->m_nodes[i].m_x.distance(at) <= btScalar(1.001));
}

TEST_CASE("a cloth that pegs below a plane hold is at rest") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 10);
  w.add(std::make_unique<btStaticPlaneShape>(vector(0, 1, 0), 0), vector(0, 0, 0));
  btSoftBody* const cloth = w.add(scenes::make_cloth(
      w.info(), columns, 5, 1, [](double u, double v) { return vector(u, 0.5 * v - 0.05, 0); }));
  for (int i = 0; i < columns; ++i) cloth->setMass(i, 0);
  CHECK(speed_in(w, *cloth, 480) < 5);
  CHECK(strain(*cloth) < 2);
}

TEST_CASE("a rail carries the nodes that are pinned inside of it") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 10);
  btRigidBody* const rail =
      w.add(std::make_unique<btBoxShape>(vector(1.2, 0.05, 0.05)), vector(0, height, 0));
  ObstacleWorld::make_kinematic(*rail);
  btSoftBody* const curtain = add_curtain(w);
  const btVector3 by = vector(0.002, 0.001, 0.002);
  const double fastest = speed_in(w, *curtain, 240, [&](int) {
    btTransform pose = rail->getWorldTransform();
    pose.setOrigin(pose.getOrigin() + by);
    rail->setWorldTransform(pose);
    shift_row(*curtain, by);
  });
  CHECK(fastest < 5);
  CHECK(strain(*curtain) < (world == World::rigid ? 1.2 : 3));
  CHECK(w.total().failsafe_holds == 0);
}

TEST_CASE("pinned nodes that are driven out of a body stop at it when they come back") {
  const World world = GENERATE(World::rigid, World::deformable);
  const std::string rail = GENERATE("box", "mesh");
  CAPTURE(world == World::rigid, rail);
  ObstacleWorld w(world, 10);
  const auto mesh = box_triangles(vector(1.2, 0.05, 0.05), false);
  std::unique_ptr<btCollisionShape> shape = std::make_unique<btBoxShape>(vector(1.2, 0.05, 0.05));
  if (rail == "mesh") shape = std::make_unique<btBvhTriangleMeshShape>(mesh.get(), true);
  w.add(std::move(shape), vector(0, height, 0));
  btSoftBody* const curtain = add_curtain(w);
  const auto drive = [&](double by) {
    return speed_in(w, *curtain, 120, [&](int) { shift_row(*curtain, vector(0, 0, by / 120)); });
  };
  CHECK(drive(0.03) < 5);  // still inside
  CHECK(drive(0.3) < 5);
  const double out = static_cast<double>(curtain->m_nodes[0].m_x.z());
  CHECK(out > 0.3);
  drive(-0.6);
  for (int i = 0; i < columns; ++i) CHECK(curtain->m_nodes[i].m_x.z() > btScalar(0.05));
}

TEST_CASE("a node that is freed inside of a body comes out and collides again") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 10);
  w.add(std::make_unique<btBoxShape>(vector(1.2, 0.1, 0.3)), vector(0, height, 0));
  btSoftBody* const curtain = add_curtain(w);
  // Lies on the rail but for the row inside of it.
  for (int i = columns; i < curtain->m_nodes.size(); ++i) {
    btSoftBody::Node& node = curtain->m_nodes[i];
    node.m_x = node.m_q =
        vector(static_cast<double>(node.m_x.x()), height + 0.15, 0.04 * (i / columns) - 0.1);
  }
  w.steps(60);
  for (int i = 0; i < columns; ++i) curtain->setMass(i, btScalar(0.04));
  const auto row_below = [&](double y) {
    return std::any_of(&curtain->m_nodes[0], &curtain->m_nodes[0] + columns,
                       [&](const auto& n) { return static_cast<double>(n.m_x.y()) < y; });
  };
  CHECK(row_below(height + 0.001));
  w.steps(480);
  CHECK(!row_below(height + 0.1));
}

TEST_CASE("nodes that are pinned in a room are in no solid") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 10);
  const auto mesh = box_triangles(vector(4, 4, 4), true);
  w.add(std::make_unique<btBvhTriangleMeshShape>(mesh.get(), true), vector(0, 0, 0));
  btSoftBody* const curtain = add_curtain(w);
  CHECK(speed_in(w, *curtain, 120) < 5);
  // Walls stop pinned nodes that are driven.
  speed_in(w, *curtain, 240, [&](int) { shift_row(*curtain, vector(0, 0.01, 0)); });
  for (int i = 0; i < columns; ++i) CHECK(curtain->m_nodes[i].m_x.y() < 4);
}
