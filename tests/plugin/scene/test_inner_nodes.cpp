// Nodes inside of bodies of tetrahedra, which belong to no face.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <BulletCollision/CollisionShapes/btTriangleMesh.h>

#include "plugin/support/worlds.h"
#include "scene/primitives.h"
#include "scenes/meshes/solid.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::bullet;
using namespace lazyccd::test;

TEST_CASE("each node of tetrahedra with a surface is at a face or an edge") {
  const int cells = GENERATE(2, 3, 4, 6);
  btSoftBodyWorldInfo info;
  const auto ball = scenes::make_ball(info, cells, 1, btVector3(0, 0, 0), 1);
  std::vector<int> uses(static_cast<std::size_t>(ball->m_nodes.size()), 0);
  const Primitives primitives = read_primitives(*ball);
  for (const Face& face : primitives.faces)
    for (const std::int32_t node : face) uses[node] = 1;
  const auto inner = std::count(uses.begin(), uses.end(), 0);
  for (const Edge& edge : primitives.edges)
    for (const std::int32_t node : edge) uses[node] = 1;
  CHECK(inner > 0);
  CHECK(std::count(uses.begin(), uses.end(), 0) == 0);
  CHECK(static_cast<std::ptrdiff_t>(primitives.edges.size()) <= inner);

  ball->m_faces.resize(0);  // no surface: the body stays with Bullet
  CHECK(read_primitives(*ball).edges.empty());
}

TEST_CASE("nodes inside of a soft ball stay above the ground on which its surface rests") {
  // The springs of a heavy ball let it collapse.
  const double mass = GENERATE(0.1, 1.0);
  const int ground = GENERATE(0, 1, 2);
  const auto world = PhysicsWorld::make(quiet_options(World::deformable, 1.0 / 60));
  btTriangleMesh square;
  if (ground == 0) {
    world->add_static(std::make_unique<btStaticPlaneShape>(btVector3(0, 1, 0), btScalar(0)),
                      btTransform::getIdentity());
  } else if (ground == 1) {
    btTransform below = btTransform::getIdentity();
    below.setOrigin(btVector3(0, btScalar(-0.5), 0));
    world->add_static(std::make_unique<btBoxShape>(btVector3(10, btScalar(0.5), 10)), below);
  } else {
    square.addTriangle(btVector3(-10, 0, -10), btVector3(-10, 0, 10), btVector3(10, 0, 10));
    square.addTriangle(btVector3(-10, 0, -10), btVector3(10, 0, 10), btVector3(10, 0, -10));
    world->add_static(std::make_unique<btBvhTriangleMeshShape>(&square, true),
                      btTransform::getIdentity());
  }
  auto owned = scenes::make_ball(world->info(), 4, mass, btVector3(0, btScalar(0.6), 0), 0.5);
  const btSoftBody& ball = *owned;
  world->add(std::move(owned));
  double lowest = 1;
  for (int step = 0; step < 120; ++step) {
    world->step();
    for (int i = 0; i < ball.m_nodes.size(); ++i)
      lowest = std::min(lowest, static_cast<double>(ball.m_nodes[i].m_x.y()));
  }
  CHECK(lowest > 0);
}
