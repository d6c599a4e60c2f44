// The scenes of the library at a small size, up to their first difficult contacts.
#include <vector>

#include "plugin/support/isa_limit.h"
#include "scenes/meshes/surface.h"
#include "scenes/run.h"
#include "support/catch.h"
#include "support/test_budget.h"

using namespace lazyccd;

namespace {

struct Case {
  const char* scene;
  scenes::World world;
  int steps;
};

constexpr scenes::World rigid = scenes::World::rigid, deformable = scenes::World::deformable;

scenes::RunReport run(const Case& chosen, scenes::Collisions collisions, double dt) {
  scenes::Parameters parameters;
  parameters.world = chosen.world;
  parameters.collisions = collisions;
  parameters.size = 0.5;
  parameters.dt = dt;
  parameters.steps = chosen.steps;
  scenes::Scene scene = scenes::set_up(*scenes::find_scene(chosen.scene), parameters);
  return scenes::run(scene);
}

// Positions after some steps.
std::vector<btScalar> end_of(const scenes::SceneInfo& info, scenes::World world, int threads) {
  scenes::Parameters parameters;
  parameters.world = world;
  parameters.dt = 1.0 / 60;
  parameters.lazyccd.detector.threads = threads;
  scenes::Scene scene = scenes::set_up(info, parameters);
  const int steps = test::is_sanitized ? 4 : 20;
  for (int i = 0; i < steps; ++i) scene.world->step();
  return scenes::read_positions(*scene.world);
}

}  // namespace

TEST_CASE("nothing passes through anything in the scenes of the library") {
  const Case chosen =
      GENERATE(Case{"crossing-ropes", rigid, 16}, Case{"crossing-ropes", deformable, 20},
               Case{"rope-on-cloth", rigid, 20}, Case{"rope-on-cloth", deformable, 20},
               Case{"twist", rigid, 60}, Case{"ball-on-spikes", rigid, 25},
               Case{"pressed-blocks", rigid, 25}, Case{"pressed-blocks", deformable, 25},
               Case{"n-body", rigid, 15}, Case{"cloth-funnel", rigid, 20},
               Case{"cloth-on-moving-mesh", rigid, 20}, Case{"cloth-on-plate", rigid, 6},
               Case{"cloth-on-plate", deformable, 6}, Case{"ball-on-net", rigid, 20},
               Case{"cloth-on-mesh", rigid, 10}, Case{"cloth-on-mesh", deformable, 10});
  CAPTURE(chosen.scene, chosen.world == rigid);
  const scenes::RunReport report = run(chosen, scenes::Collisions::lazyccd, 1.0 / 60);
  CHECK(report.finite);
  CHECK(report.initial_intersections == 0);
  CHECK(report.crossings_vf == 0);
  CHECK(report.crossings_ee == 0);
  CHECK(report.intersections.empty());
  CHECK(report.wrong_side.value_or(0) == 0);
  CHECK(report.lazyccd.contacts_vf + report.lazyccd.contacts_ee > 0);
  CHECK(report.lazyccd.fallback_steps == 0);
}

TEST_CASE("the counters find that ropes and meshes pass through with Bullet alone") {
  const scenes::RunReport ropes =
      run({"crossing-ropes", rigid, 20}, scenes::Collisions::bullet, 1.0 / 60);
  CHECK(ropes.crossings_ee > 0);
  const scenes::RunReport mesh =
      run({"cloth-on-mesh", rigid, 10}, scenes::Collisions::bullet, 1.0 / 60);
  CHECK(mesh.crossings_vf > 0);
  CHECK(mesh.wrong_side.value_or(0) > 0);
}

TEST_CASE("the motion of every scene is the same to the bit with any number of threads") {
  const scenes::World world = GENERATE(rigid, deformable);
  for (const scenes::SceneInfo& info : scenes::all_scenes()) {
    CAPTURE(info.name, world == rigid);
    const std::vector<btScalar> expected = end_of(info, world, 1);
    for (const int threads : {2, 3, 16}) CHECK(end_of(info, world, threads) == expected);
  }
}

TEST_CASE("the motion of every scene is the same to the bit with any instruction set") {
  const scenes::World world = GENERATE(rigid, deformable);
  for (const scenes::SceneInfo& info : scenes::all_scenes()) {
    CAPTURE(info.name, world == rigid);
    std::vector<btScalar> expected;
    for (const char* const name : {"baseline", "avx2", "avx512"}) {
      const test::IsaLimit limit(name);
      if (!test::IsaLimit::chooses(name)) continue;  // this processor lacks it
      const std::vector<btScalar> end = end_of(info, world, 1);
      if (expected.empty()) expected = end;
      CHECK(end == expected);
    }
    CHECK_FALSE(expected.empty());
  }
}
