// Rigid bodies that turn far in a step.
#include <BulletCollision/CollisionShapes/btBoxShape.h>

#include "plugin/support/obstacle_worlds.h"
#include "random/random_source.h"

#include "support/catch.h"

using namespace lazyccd;
using lazyccd::test::ObstacleWorld;
using scenes::World;

TEST_CASE("small boxes that spin fast tumble on a cloth, and impulses are enough") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 10);
  btSoftBody* const cloth = w.add_sheet(15, 0.2, 0, 0);
  cloth->getCollisionShape()->setMargin(btScalar(1e-5));
  for (int i = 0; i < 15; ++i) {
    for (const int node : {i, 210 + i, 15 * i, 15 * i + 14}) cloth->setMass(node, 0);
  }
  test::RandomSource random(5);
  for (int i = 0; i < 5; ++i) {
    const auto half = btScalar(0.005);
    btRigidBody* const box = w.add(
        std::make_unique<btBoxShape>(btVector3(half, half, half)),
        btVector3(btScalar(0.025) * static_cast<btScalar>(i - 2), btScalar(0.04), 0), 0.01, 0.0005);
    box->setAngularVelocity(btScalar(70) * random.direction());
    box->setActivationState(DISABLE_DEACTIVATION);
  }
  w.steps(60, 1.0 / 60);
  CHECK(w.total().contact_rows > 0);
  CHECK(w.total().failsafe_holds == 0);
  CHECK(w.total().unresolved == 0);
  // Without Newton steps for the rotations: 470 and 949.
  CHECK(w.total().detections < 300);
}
