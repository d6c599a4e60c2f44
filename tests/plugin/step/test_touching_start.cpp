// Bodies that start exactly at each other's surface.
#include <BulletCollision/CollisionShapes/btBoxShape.h>

#include <memory>

#include "assertions/failed_belief.h"
#include "plugin/support/obstacle_worlds.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

// Cloth of four nodes at exactly the height of the upper face of a box.
void drop_cloth_at_gap_zero() {
  bullet::SolverOptions options;
  options.detector.threads = 1;
  ObstacleWorld world(scenes::World::rigid, 9.81, options);
  world.add(std::make_unique<btBoxShape>(btVector3(5, btScalar(0.5), 5)),
            btVector3(0, btScalar(-0.5), 0), 0, 0.04);
  world.add(scenes::make_cloth(world.info(), 2, 2, 0.2,
                               [](double u, double v) {
                                 return btVector3(static_cast<btScalar>(u - 0.5), 0,
                                                  static_cast<btScalar>(v - 0.5));
                               }),
            0.02);
  world.steps(2, 1.0 / 60);
}

}  // namespace

// The cloth falls through the box: old and new rows of a pair act with both signs.
TEST_CASE("cloth that starts at gap zero gets rows of both signs, and an assertion says so") {
  if (!finds_failed_beliefs) return;
  CHECK(failed_belief(drop_cloth_at_gap_zero) ==
        "rows of a pair that is in contact at the start have one sign");
}
