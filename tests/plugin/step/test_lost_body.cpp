// Bodies that fall off the world do not change what the others do.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletSoftBody/btDeformableLinearElasticityForce.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>

#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "plugin/support/obstacle_worlds.h"
#include "plugin/support/tetrahedra.h"
#include "plugin/support/worlds.h"
#include "random/lost_body.h"
#include "scenes/meshes/shapes.h"
#include "scenes/meshes/solid.h"
#include "support/catch.h"
#include "support/test_budget.h"

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

TEST_CASE("nothing in a scene of the library notices a body that gets lost") {
  const auto [name, world] = GENERATE(
      std::pair("n-body", World::rigid), std::pair("cloth-on-mesh", World::rigid),
      std::pair("pressed-blocks", World::rigid), std::pair("cloth-on-mesh", World::deformable));
  const Loss loss = GENERATE(from_range(std::begin(all_losses), std::end(all_losses)));
  CAPTURE(name, world == World::rigid, name_of(loss));
  scenes::Parameters parameters;
  parameters.world = world;
  parameters.size = 0.5;
  parameters.dt = 1.0 / (world == World::rigid ? 60 : 240);
  parameters.steps = is_sanitized ? 8 : 30;
  parameters.lazyccd.detector.threads = 1;
  const LostBodyReport report = run_with_lost_body(*scenes::find_scene(name), parameters, loss);
  CAPTURE(report.farthest, report.status);
  if (world == World::rigid)
    CHECK(report.is_same);
  else
    CHECK(report.farthest <= report.thickness / 10);
}

TEST_CASE("a body that overflows Bullet's bounds is named until it is small again") {
  const World kind = GENERATE(World::rigid, World::deformable);
  const int state = GENERATE(ACTIVE_TAG, DISABLE_DEACTIVATION);
  ObstacleWorld world(kind, 9.81);
  btSoftBody* const cloth = world.add_sheet(4, 1, 0, 0);
  cloth->forceActivationState(state);
  world.steps(1, 1.0 / 60);
  const btVector3 place = cloth->m_nodes[3].m_x;
  cloth->m_nodes[3].m_x = btVector3(btScalar(1e7), 0, 0);
  world.steps(2, 1.0 / 60);
  CHECK((cloth->getActivationState() == DISABLE_SIMULATION) == (state == ACTIVE_TAG));
  REQUIRE(world.excluded_bodies().size() == 1);
  CHECK(world.excluded_bodies()[0].body == cloth);
  for (int i = 0; i < cloth->m_nodes.size(); ++i) {
    cloth->m_nodes[i].m_x = cloth->m_nodes[i].m_q =
        place + btVector3(btScalar(0.1 * (i % 4)), 0, btScalar(0.1 * (i / 4)));
    cloth->m_nodes[i].m_v.setZero();
  }
  cloth->forceActivationState(state);
  world.steps(2, 1.0 / 60);
  CHECK(world.excluded_bodies().empty());
}

TEST_CASE("a body with inverted tetrahedra is named if a force acts on them, until it is mended") {
  ObstacleWorld world(World::deformable, 9.81);
  btSoftBody* const cube = world.add(scenes::make_solid(
      world.info(), 1, 1, [](double u, double v, double w) { return scenes::vector(u, v, w); }));
  orient_tetrahedra(*cube);
  for (int i = 0; i < cube->m_tetras.size(); ++i)
    std::swap(cube->m_tetras[i].m_n[0], cube->m_tetras[i].m_n[1]);
  cube->initializeDmInverse();
  world.steps(2, 1.0 / 240);
  CHECK(world.excluded_bodies().empty());
  btDeformableLinearElasticityForce force(100, 100, btScalar(0.01));
  static_cast<btDeformableMultiBodyDynamicsWorld&>(world.world()).addForce(cube, &force);
  world.steps(2, 1.0 / 240);
  REQUIRE(world.excluded_bodies().size() == 1);
  CHECK(world.excluded_bodies()[0].reason == bullet::ExclusionReason::inverted);
  CHECK(world.excluded_bodies()[0].node >= 0);
  CHECK(world.status().find("tetrahedra are inverted") != std::string::npos);
  orient_tetrahedra(*cube);
  world.steps(2, 1.0 / 240);
  CHECK(world.excluded_bodies().empty());
}

TEST_CASE("a body whose step cannot be resolved is named until it is slower") {
  ObstacleWorld world(World::rigid, 0);  // Bullet's deformable world slows such a body down
  btSoftBody* const cloth = world.add_sheet(4, 1, 0, 0);
  world.steps(1, 1.0 / 60);
  cloth->setVelocity(btVector3(0, btScalar(1e6), 0));
  world.steps(2, 1.0 / 60);
  REQUIRE(world.excluded_bodies().size() == 1);
  CHECK(world.excluded_bodies()[0].reason == bullet::ExclusionReason::unresolved_step);
  cloth->setVelocity(btVector3(0, 0, 0));
  world.steps(2, 1.0 / 60);
  CHECK(world.excluded_bodies().empty());
}

TEST_CASE("what is left to Bullet is said once") {
  ObstacleWorld world(World::deformable, 0);
  btSoftBody* const cloth = world.add_sheet(4, 1, 0, 0);
  btRigidBody* const box =
      world.add(std::make_unique<btBoxShape>(btVector3(1, 1, 1)), btVector3(0, -3, 0), 1);
  cloth->m_cfg.collisions |= btSoftBody::fCollision::CL_RS;
  cloth->appendDeformableAnchor(0, box);
  cloth->m_materials[0]->m_kLST = 2;
  world.steps(3, 1.0 / 240);
  const std::string status = world.status();
  for (const char* const words : {"its clusters", "its anchors", "a stiffness of its materials"}) {
    const std::size_t first = status.find(words);
    REQUIRE(first != std::string::npos);
    CHECK(status.find(words, first + 1) == std::string::npos);
  }
}

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
