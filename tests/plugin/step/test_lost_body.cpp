// Bodies that fall off the world do not change what the others do.
#include <BulletCollision/CollisionShapes/btBoxShape.h>

#include <memory>
#include <vector>

#include "plugin/support/obstacle_worlds.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

// Steps a cloth on a box. Another one is `depth` metres below and falls on; 0: there is none.
// Returns the positions of the first cloth after each step.
std::vector<btVector3> step_cloth_on_box(scenes::World kind, double depth) {
  bullet::SolverOptions options;
  options.detector.threads = 1;
  ObstacleWorld world(kind, 9.81, options);
  world.add(std::make_unique<btBoxShape>(btVector3(5, btScalar(0.5), 5)),
            btVector3(0, btScalar(-0.5), 0), 0, 0.04);
  const auto add_cloth = [&world](double height) {
    return world.add(scenes::make_cloth(world.info(), 5, 5, 0.2,
                                        [height](double u, double v) {
                                          return btVector3(static_cast<btScalar>(u - 0.5),
                                                           static_cast<btScalar>(height),
                                                           static_cast<btScalar>(v - 0.5));
                                        }),
                     0.001);
  };
  const btSoftBody* const cloth = add_cloth(0.05);
  if (depth > 0) {
    btSoftBody* const lost = add_cloth(-depth);
    lost->setVelocity(btVector3(0, -300, 0));
  }
  std::vector<btVector3> positions;
  for (int i = 0; i < 120; ++i) {
    world.steps(1, 1.0 / 60);
    for (int k = 0; k < cloth->m_nodes.size(); ++k) positions.push_back(cloth->m_nodes[k].m_x);
  }
  return positions;
}

}  // namespace

TEST_CASE("a cloth rests where it would, however far another one has fallen") {
  const double depth = GENERATE(20.0, 2e4, 2e6);
  CAPTURE(depth);
  const std::vector<btVector3> alone = step_cloth_on_box(scenes::World::rigid, 0);
  CHECK(step_cloth_on_box(scenes::World::rigid, depth) == alone);
  const std::vector<btVector3> deformable = step_cloth_on_box(scenes::World::deformable, depth);
  constexpr double tenth_of_thickness = 0.0041;
  CHECK_THAT(static_cast<double>(deformable.back().y()),
             Matchers::WithinAbs(static_cast<double>(alone.back().y()), tenth_of_thickness));
}
