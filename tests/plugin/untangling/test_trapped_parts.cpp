// What is trapped in a body that nothing moves does not collide with it; everything else does.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

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

constexpr double radius = 0.3;  // of the ball

// A square of 1.2 m and 0.3 kg. Its nodes are 1.2 m / (`nodes` - 1) apart.
btSoftBody* add_rug(ObstacleWorld& w, double height, int nodes = 17) {
  btSoftBody* const rug =
      w.add(scenes::make_cloth(
                w.info(), nodes, nodes, 0.3,
                [&](double u, double v) { return vector(1.2 * u - 0.6, height, 1.2 * v - 0.6); }),
            0.02);
  rug->m_cfg.kDF = btScalar(0.5);
  return rug;
}

void add_floor(ObstacleWorld& w) {
  w.add(std::make_unique<btBoxShape>(vector(20, 1, 20)), vector(0, -1, 0));
}

// Stands on the floor, or is sunk into it by `depth`.
btRigidBody* add_furniture(ObstacleWorld& w, const std::string& kind, double depth) {
  if (kind == "ball")
    return w.add(std::make_unique<btSphereShape>(btScalar(radius)),
                 vector(0.01, radius - depth, 0.02));
  if (kind == "capsule")
    return w.add(std::make_unique<btCapsuleShapeX>(btScalar(0.15), btScalar(0.4)),
                 vector(0.01, 0.15 - depth, 0.02));
  std::mt19937 random(7);
  std::uniform_real_distribution<double> coordinate(-1, 1);
  auto hull = std::make_unique<btConvexHullShape>();
  for (int i = 0; i < 60; ++i) {
    const btVector3 point = vector(coordinate(random), coordinate(random), coordinate(random));
    hull->addPoint(point.normalized() * btScalar(radius));
  }
  return w.add(std::move(hull), vector(0.01, radius - 0.01 - depth, 0.02));
}

// Of a node from the middle of the body, metres.
double distance(const btSoftBody::Node& node, const btRigidBody& body) {
  return static_cast<double>(node.m_x.distance(body.getWorldTransform().getOrigin()));
}

// Smallest distance of a node.
double nearest(const btSoftBody& cloth, const btRigidBody& body) {
  double smallest = 1e9;
  for (int i = 0; i < cloth.m_nodes.size(); ++i)
    smallest = std::min(smallest, distance(cloth.m_nodes[i], body));
  return smallest;
}

std::vector<int> nodes_outside(const btSoftBody& cloth, const btRigidBody& ball) {
  std::vector<int> nodes;
  for (int i = 0; i < cloth.m_nodes.size(); ++i)
    if (distance(cloth.m_nodes[i], ball) > radius) nodes.push_back(i);
  return nodes;
}

}  // namespace

TEST_CASE("a rug through which a round body stands on the floor comes to rest") {
  const World world = GENERATE(World::rigid, World::deformable);
  const std::string kind = GENERATE(sweep({"ball", "capsule", "hull"}));
  const bool is_later = GENERATE(false, true);  // the rug lies there already
  const double depth = GENERATE(sweep({0.0, 0.05}));
  CAPTURE(world == World::rigid, kind, is_later, depth);
  ObstacleWorld w(world, 10);
  add_floor(w);
  const btSoftBody* const rug = add_rug(w, 0.03);
  if (is_later) w.steps(60, 1.0 / 60);
  add_furniture(w, kind, depth);
  w.steps(480);
  double fastest = 0;
  w.steps(240, 1.0 / 240, [&](int) { fastest = std::max(fastest, speed(*rug)); });
  CHECK(fastest < 0.5);
  CHECK(strain(*rug) < 4);
  CHECK(w.total().initial_intersections > 0);
  CHECK(w.total().failsafe_holds == 0);
}

TEST_CASE("a coarse rug is at rest on a ball whose way out is blocked") {
  const World world = GENERATE(World::rigid, World::deformable);
  const double lift = GENERATE(0, 0.02);  // of the ball above the floor
  CAPTURE(world == World::rigid, lift);
  ObstacleWorld w(world, 10);
  add_floor(w);
  add_furniture(w, "ball", -lift);
  const btSoftBody* const rug = add_rug(w, 0.03, 9);
  w.steps(480);
  CHECK(speed(*rug) < 0.1);
  CHECK(strain(*rug) < 1.2);
}

TEST_CASE("nodes of a rug outside of the ball that stands in it stay outside") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 10);
  add_floor(w);
  const btRigidBody* const ball = add_furniture(w, "ball", 0);
  btSoftBody* const rug = add_rug(w, 0.03);
  const std::vector<int> outside = nodes_outside(*rug, *ball);
  CHECK(outside.size() < static_cast<std::size_t>(rug->m_nodes.size()));
  // One border is pulled.
  w.steps(480, 1.0 / 240, [&](int) {
    for (int i = 0; i < 17; ++i) rug->addForce(vector(0, 0, -0.3), i);
  });
  for (const int i : outside) CHECK(distance(rug->m_nodes[i], *ball) > 0.995 * radius);
}

TEST_CASE("a ball that leaves the rug in which it stood meets it when it comes back") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 10);
  add_floor(w);
  btRigidBody* const ball = add_furniture(w, "ball", 0);
  ObstacleWorld::make_kinematic(*ball);
  btSoftBody* const rug = add_rug(w, 0.03);
  for (const int corner : {0, 16, 17 * 16, 17 * 17 - 1}) rug->setMass(corner, 0);
  const auto move = [&](double by) {
    w.steps(240, 1.0 / 240, [&](int) {
      btTransform pose = ball->getWorldTransform();
      pose.getOrigin() += vector(0, by / 240, 0);
      ball->setWorldTransform(pose);
    });
  };
  w.steps(60);
  CHECK(nearest(*rug, *ball) < 0.98 * radius);
  move(0.2);
  CHECK(nearest(*rug, *ball) > radius);
  move(-0.17);
  CHECK(nearest(*rug, *ball) > 0.99 * radius);
}

TEST_CASE("a rug in which a ball stands catches what falls on it") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 10);
  // The rug hangs at its corners, and a post pierces it.
  w.add(std::make_unique<btBoxShape>(vector(0.05, 2, 0.05)), vector(0.02, 0, 0.03));
  btSoftBody* const rug = add_rug(w, 0.5);
  for (const int corner : {0, 16, 17 * 16, 17 * 17 - 1}) rug->setMass(corner, 0);
  const btRigidBody* const ball =
      w.add(std::make_unique<btSphereShape>(btScalar(0.1)), vector(0.25, 0.8, 0.25), 0.1);
  w.steps(480);
  CHECK(nearest(*rug, *ball) > 0.099);
  const btScalar middle = ball->getWorldTransform().getOrigin().y();
  CHECK(std::any_of(&rug->m_nodes[0], &rug->m_nodes[0] + rug->m_nodes.size(), [&](const auto& n) {
    return distance(n, *ball) < 0.2 && n.m_x.y() < middle - btScalar(0.05);
  }));
}

TEST_CASE("a cloth that falls on a ball that stands in a rug does not enter the ball") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 10);
  add_floor(w);
  const btRigidBody* const ball = add_furniture(w, "ball", 0);
  const btSoftBody* const rug = add_rug(w, 0.03);
  const btSoftBody* const cloth = w.add_sheet(17, 1, 0.8, 0);
  w.steps(480);
  CHECK(nearest(*rug, *ball) < 0.98 * radius);
  CHECK(nearest(*cloth, *ball) > 0.995 * radius);
}
