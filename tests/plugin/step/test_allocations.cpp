// Once a scene rests, a step allocates nothing. Islands of more than a thousand rows do: the
// library that sorts them takes memory for its bins.
#include <BulletCollision/CollisionShapes/btBoxShape.h>

#include <cstddef>
#include <memory>

#include "plugin/support/allocations.h"
#include "plugin/support/obstacle_worlds.h"
#include "scenes/meshes/cloth.h"
#include "scenes/meshes/shapes.h"
#include "support/catch.h"
#include "support/test_budget.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::vector;
using scenes::World;

namespace {

// Allocations of ten steps of a cloth that rests on a box, and of a box on it.
long allocations_at_rest(int nodes, World world) {
  bullet::SolverOptions options;
  options.detector.threads = 1;
  ObstacleWorld w(world, 10, options);
  w.add(std::make_unique<btBoxShape>(vector(1, 0.5, 1)), vector(0, -0.5, 0));
  w.add(scenes::make_cloth(w.info(), nodes, nodes, 1,
                           [=](double u, double v) { return vector(u - 0.5, 0.02, v - 0.5); }),
        0.01);
  w.add(std::make_unique<btBoxShape>(vector(0.1, 0.1, 0.1)), vector(0, 0.15, 0), 0.1);
  w.steps(120, 1.0 / 60);
  CHECK(!w.contacts().empty());
  const long before = allocation_count();
  w.steps(10, 1.0 / 60);
  return allocation_count() - before;
}

}  // namespace

TEST_CASE("a step at rest allocates nothing") {
  if (is_sanitized) return;  // nothing is counted
  for (const World world : {World::rigid, World::deformable}) {
    for (const int nodes : {5, 21}) {
      CAPTURE(world == World::rigid, nodes);
      CHECK(allocations_at_rest(nodes, world) == 0);
    }
  }
}
