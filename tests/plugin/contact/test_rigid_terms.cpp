// What contacts do to the rigid bodies in them.
#include <BulletCollision/CollisionShapes/btSphereShape.h>

#include <memory>

#include "plugin/support/obstacle_worlds.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::World;

TEST_CASE("a ball without friction is not turned by the cloth that it falls on") {
  const World kind = GENERATE(World::rigid, World::deformable);
  CAPTURE(kind);
  bullet::SolverOptions options;
  options.friction = false;
  ObstacleWorld world(kind, 10, options);
  // Edges much longer than the radius, so that the triangles of the ball meet them.
  btSoftBody* const cloth = world.add_sheet(6, 2, 0, 0);
  scenes::pin_border(*cloth, 6, 6);
  btRigidBody* const ball =
      world.add(std::make_unique<btSphereShape>(btScalar(0.1)),
                btVector3(btScalar(0.13), btScalar(0.3), btScalar(0.07)), 0.2);
  ball->setActivationState(DISABLE_DEACTIVATION);
  world.steps(240);
  CHECK(world.total().contacts_vf + world.total().contacts_ee > 0);
  CHECK(ball->getAngularVelocity().length() < btScalar(0.01));
}
