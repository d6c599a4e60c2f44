#include "plugin/worlds.h"
#include "scenes/crossings.h"
#include "scenes/piercings.h"
#include "scenes/scene.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;

TEST_CASE("what is driven faster than it can give way stops before it passes through itself") {
  scenes::Parameters parameters;
  parameters.world = GENERATE(World::rigid, World::deformable);
  parameters.speed = 8;
  parameters.dt = 1.0 / 60;
  parameters.margin = 0.01;
  parameters.size = 0.5;
  scenes::Scene scene = scenes::set_up(*scenes::find_scene("twist"), parameters);
  scenes::CrossingCounter crossings(*scene.world);
  for (int i = 0; i < scene.steps; ++i) {
    scene.world->step();
    crossings.step(*scene.world);
  }
  CHECK(crossings.vertex_face() + crossings.edge_edge() == 0);
  CHECK(scenes::find_piercings(scenes::read_surface(*scene.world),
                               scenes::read_positions(*scene.world))
            .empty());
  CHECK(scene.world->total_stats()->unresolved == 0);
}
