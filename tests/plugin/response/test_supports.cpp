// Cloth on dynamic bodies that stand on something: it presses none of them into what supports them.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "plugin/support/obstacle_worlds.h"
#include "support/catch.h"
#include "support/test_budget.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::World;

namespace {

constexpr double gravity = 10, dt = 1.0 / 60, cloth_mass = 1, margin = 0.03, half = 0.25;

std::unique_ptr<btCollisionShape> box(double x, double y, double z) {
  return std::make_unique<btBoxShape>(
      btVector3(static_cast<btScalar>(x), static_cast<btScalar>(y), static_cast<btScalar>(z)));
}

btVector3 at(double x, double y) {
  return btVector3(static_cast<btScalar>(x), static_cast<btScalar>(y), 0);
}

btSoftBody* add_cloth(ObstacleWorld& w, double width, double x, double height) {
  constexpr int nodes = 13;
  btSoftBody* const cloth =
      w.add(scenes::make_cloth(w.info(), nodes, nodes, 1,
                               [&](double u, double v) {
                                 return at(x + width * (u - 0.5), height) +
                                        btVector3(0, 0, static_cast<btScalar>(width * (v - 0.5)));
                               }),
            margin);
  cloth->setTotalMass(btScalar(cloth_mass));
  cloth->m_cfg.kDF = btScalar(0.5);
  return cloth;
}

// How far nodes are inside of a box with these half edges, metres.
double depth_in(const btSoftBody& cloth, const btRigidBody& body, double half_edge) {
  double deepest = 0;
  for (int i = 0; i < cloth.m_nodes.size(); ++i) {
    const btVector3 x = body.getWorldTransform().inverse() * cloth.m_nodes[i].m_x;
    const btVector3 inside = btVector3(1, 1, 1) * static_cast<btScalar>(half_edge) - x.absolute();
    deepest = std::max(deepest, static_cast<double>(inside[inside.minAxis()]));
  }
  return deepest;
}

double height_of(const btRigidBody& body) {
  return static_cast<double>(body.getWorldTransform().getOrigin().y());
}

// Sum of Bullet's impulses at the floor in the last step, N s.
double load_of(ObstacleWorld& w, const btRigidBody& floor) {
  double load = 0;
  btDispatcher& dispatcher = *w.world().getDispatcher();
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
    if (manifold.getBody0() != &floor && manifold.getBody1() != &floor) continue;
    for (int k = 0; k < manifold.getNumContacts(); ++k)
      load += static_cast<double>(manifold.getContactPoint(k).m_appliedImpulse);
  }
  return load;
}

}  // namespace

TEST_CASE("cloth does not press the boxes below it into the floor or into each other") {
  const World kind = GENERATE(World::rigid, World::deformable);
  const int count = GENERATE(1, 2);
  const double box_mass = GENERATE(sweep({0.5, 1.0, 5.0}));
  CAPTURE(kind == World::rigid, count, box_mass);
  ObstacleWorld w(kind, gravity);
  const btRigidBody* const floor = w.add(box(5, 1, 5), at(0, -1));
  std::vector<const btRigidBody*> boxes;
  for (int i = 0; i < count; ++i)
    boxes.push_back(w.add(box(half, half, half), at(0, half * (2 * i + 1)), box_mass));
  const btSoftBody* const cloth = add_cloth(w, 0.6, 0, 2 * half * count + margin + 0.1);
  double deepest = 0;
  for (int step = 0; step < 240; ++step) {
    w.steps(1, dt);
    double below = 0;  // top of what is below the box
    for (const btRigidBody* const each : boxes) {
      CHECK(height_of(*each) - half > below - 2e-3);
      below = height_of(*each) + half;
      deepest = std::max(deepest, depth_in(*cloth, *each, half));
    }
  }
  CHECK(deepest == 0);
  // The floor carries the cloth.
  double load = 0;
  for (int step = 0; step < 60; ++step) {
    w.steps(1, dt);
    load += load_of(w, *floor) / 60;
  }
  CHECK(load == Approx((cloth_mass + count * box_mass) * gravity * dt).epsilon(0.03));
  CHECK(w.total().failsafe_holds == 0);
}

TEST_CASE("cloth that falls fast on a light box does not throw it through the floor") {
  ObstacleWorld w(World::rigid, gravity);
  w.add(box(5, 1, 5), at(0, -1));
  const btRigidBody* const body = w.add(box(half, half, half), at(0, half), 0.1);
  btSoftBody* const cloth = add_cloth(w, 0.6, 0, 2 * half + 0.2);
  cloth->setVelocity(btVector3(0, -8, 0));
  for (int step = 0; step < 120; ++step) {
    w.steps(1, dt);
    CHECK(std::abs(height_of(*body) - half) < 0.01);
    CHECK(depth_in(*cloth, *body, half) == 0);
  }
}

TEST_CASE("a light box that bounces is not thrown by heavy cloth on it") {
  ObstacleWorld w(World::rigid, gravity);
  btRigidBody* const floor = w.add(box(5, 1, 5), at(0, -1));
  btRigidBody* const body = w.add(box(half, half, half), at(0, half), 0.02);
  floor->setRestitution(1);
  body->setRestitution(btScalar(0.5));
  add_cloth(w, 0.6, 0, 2 * half + 0.1);
  for (int step = 0; step < 240; ++step) {
    w.steps(1, dt);
    CHECK(std::abs(height_of(*body) - half) < half);
  }
}

TEST_CASE("cloth tips a plank that hangs over an edge if it is heavy enough") {
  const double plank_mass = GENERATE(1.0, 20.0);
  CAPTURE(plank_mass);
  ObstacleWorld w(World::rigid, gravity);
  w.add(box(0.5, 0.5, 0.5), at(0, -0.5));
  btRigidBody* const plank = w.add(box(1, 0.05, 0.3), at(0.3, 0.05), plank_mass);
  add_cloth(w, 0.3, 1.1, 0.2);
  w.steps(40, dt);
  const double turned = static_cast<double>(plank->getWorldTransform().getRotation().getAngle());
  CHECK((turned > 0.3) == (plank_mass < 10));
}
