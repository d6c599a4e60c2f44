// What a step allocates does not grow with its contacts.
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

struct RestingCloth {
  std::size_t contacts;
  long allocations;  // in a step
};

RestingCloth rest_on_box(int nodes, World world) {
  bullet::SolverOptions options;
  options.detector.threads = 1;
  ObstacleWorld w(world, 10, options);
  w.add(std::make_unique<btBoxShape>(vector(1, 0.5, 1)), vector(0, -0.5, 0));
  w.add(scenes::make_cloth(w.info(), nodes, nodes, 1,
                           [=](double u, double v) { return vector(u - 0.5, 0.02, v - 0.5); }),
        0.01);
  w.steps(60, 1.0 / 60);
  const long before = allocation_count();
  w.steps(10, 1.0 / 60);
  return {w.contacts().size(), (allocation_count() - before) / 10};
}

}  // namespace

TEST_CASE("what a step allocates does not grow with its contacts") {
  if (is_sanitized) return;  // nothing is counted
  for (const World world : {World::rigid, World::deformable}) {
    const RestingCloth small = rest_on_box(5, world), large = rest_on_box(31, world);
    CAPTURE(small.contacts, large.contacts, small.allocations, large.allocations);
    CHECK(large.contacts > 20 * small.contacts);
    CHECK(large.allocations <= small.allocations + 10);
    CHECK(small.allocations < 80);
  }
}
