// Nodes of one soft body that lie at the same place at first.
#include <algorithm>
#include <memory>

#include "plugin/support/obstacle_worlds.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::World;

namespace {

constexpr int side = 5, panel = side * side;  // nodes
constexpr double dt = 1.0 / 240;

// A level cloth of two panels. The right one has its own nodes where it meets the left one, at
// x = 0. Triangles of no area and links of no length sew them together if asked.
std::unique_ptr<btSoftBody> two_panels(btSoftBodyWorldInfo& info, bool sewn) {
  const auto place = [](int i) {
    return btVector3(btScalar(0.25) * static_cast<btScalar>(i % side), 0,
                     btScalar(0.25) * static_cast<btScalar>(i / side));
  };
  auto cloth = scenes::make_cloth(info, side, side, 0.5, [&](double u, double v) {
    return btVector3(static_cast<btScalar>(u - 1), 0, static_cast<btScalar>(v));
  });
  for (int i = 0; i < panel; ++i) cloth->appendNode(place(i), btScalar(0.5 / panel));
  for (int i = 0; i < panel; ++i) {
    const int n = panel + i;
    if (i % side + 1 < side) cloth->appendLink(n, n + 1);
    if (i / side + 1 < side) cloth->appendLink(n, n + side);
    if (i % side + 1 == side || i / side + 1 == side) continue;
    cloth->appendFace(n, n + side, n + 1);
    cloth->appendFace(n + 1, n + side, n + side + 1);
    cloth->appendLink(n + 1, n + side);
  }
  for (int row = 0; sewn && row < side; ++row) {
    const int left = row * side + side - 1, right = panel + row * side;
    cloth->appendLink(left, right);
    if (row + 1 < side) cloth->appendFace(left, right, left + side);
  }
  cloth->setSelfCollision(true);
  return cloth;
}

}  // namespace

TEST_CASE("triangles that meet at a closed seam do not collide") {
  const bool sewn = GENERATE(false, true);
  const World kind = GENERATE(World::rigid, World::deformable);
  CAPTURE(sewn, kind);
  ObstacleWorld world(kind, 10);
  btSoftBody* const cloth = world.add(two_panels(world.info(), sewn), 0.02);
  for (int row = 0; row < side; ++row) {
    cloth->setMass(row * side, 0);
    cloth->setMass(panel + row * side + side - 1, 0);
  }
  for (int i = 0; i < 60; ++i) {
    world.steps(1, dt);
    CHECK(world.last().contacts_vf + world.last().contacts_ee == 0);
    CHECK(world.last().detections <= 2);
  }
}

TEST_CASE("triangles that met at a seam collide when it has opened") {
  const World kind = GENERATE(World::rigid, World::deformable);
  const double speed = GENERATE(5.0, 40.0);  // m/s; the faster one leaves a small gap at first
  CAPTURE(kind, speed);
  ObstacleWorld world(kind, 10);
  btSoftBody* const cloth = world.add(two_panels(world.info(), false), 0.02);
  for (int i = 0; i < panel; ++i) cloth->setMass(i, 0);
  world.steps(1, dt);
  // The right panel is laid over the left one, seam over seam, and thrown down.
  for (int i = panel; i < 2 * panel; ++i) {
    btSoftBody::Node& node = cloth->m_nodes[i];
    node.m_x = node.m_q = btVector3(-node.m_x.x(), btScalar(0.2), node.m_x.z());
    node.m_v = btVector3(0, static_cast<btScalar>(-speed), 0);
  }
  btScalar lowest = 1;
  for (int i = 0; i < 80; ++i) {
    world.steps(1, dt);
    for (int n = panel; n < 2 * panel; ++n) lowest = btMin(lowest, cloth->m_nodes[n].m_x.y());
  }
  CHECK(lowest > 0);
  CHECK(lowest < btScalar(0.1));
}

TEST_CASE("a seam stays known while its body sleeps and when other bodies come") {
  ObstacleWorld world(World::rigid, 0);
  btSoftBody* const cloth = world.add(two_panels(world.info(), false), 0.02);
  world.steps(1, dt);
  // Closed, but no longer at the same place.
  cloth->m_nodes[panel].m_x.setY(btScalar(1e-4));
  cloth->m_nodes[panel].m_q = cloth->m_nodes[panel].m_x;
  cloth->forceActivationState(ISLAND_SLEEPING);
  world.steps(1, dt);
  world.add(scenes::make_cloth(world.info(), 3, 3, 1, [](double u, double v) {
    return btVector3(static_cast<btScalar>(u), 1, static_cast<btScalar>(v));
  }));
  cloth->forceActivationState(DISABLE_DEACTIVATION);
  for (int i = 0; i < 10; ++i) {
    world.steps(1, dt);
    CHECK(world.last().contacts_vf + world.last().contacts_ee == 0);
  }
}
