#include "plugin/support/worlds.h"
#include "scenes/measures/intersections.h"
#include "scenes/measures/mechanics.h"
#include "scenes/scene.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

scenes::Surface two_triangles() {
  scenes::Surface surface;
  surface.faces = {{0, 1, 2}, {3, 4, 5}};
  surface.body_of_vertex = {0, 0, 0, 1, 1, 1};
  surface.inverse_mass.assign(6, 1);
  surface.bodies.resize(2);
  return surface;
}

// A triangle in the plane y = 0 and one that points down. Its lowest corner is at height y.
std::vector<btScalar> pointing_down_to(double y) {
  const btScalar h = static_cast<btScalar>(y);
  return {-1, 0, -1, 2, 0, -1, -1, 0, 2, 0, h, 0, btScalar(0.1), h + 1, 0, 0, h + 1, btScalar(0.1)};
}

}  // namespace

TEST_CASE("a triangle that intersects another has two edge-face intersections") {
  const auto found = scenes::find_intersections(two_triangles(), pointing_down_to(-0.5));
  REQUIRE(found.size() == 2);
  CHECK_THAT(found[0].point[1], Matchers::WithinAbs(0, 1e-6));
}

TEST_CASE("triangles that touch or stay apart do not intersect") {
  CHECK(scenes::find_intersections(two_triangles(), pointing_down_to(0)).empty());
  CHECK(scenes::find_intersections(two_triangles(), pointing_down_to(0.01)).empty());
  CHECK(scenes::find_intersections(two_triangles(), pointing_down_to(-3)).empty());
}

TEST_CASE("an intersection by the last bit is found") {
  const btScalar tiny = std::numeric_limits<btScalar>::denorm_min();
  auto positions = pointing_down_to(0);
  positions[10] = -tiny;
  CHECK(scenes::find_intersections(two_triangles(), positions).size() == 2);
}

TEST_CASE("no intersection is counted for bodies that do not collide") {
  scenes::Surface surface = two_triangles();
  surface.bodies[0].mask = 0;
  CHECK(scenes::find_intersections(surface, pointing_down_to(-0.5)).empty());
}

TEST_CASE("the crossing counter finds a body that jumps through another") {
  Impact impact(quiet_options(World::rigid));
  scenes::CrossingCounter crossings(*impact.world);
  impact.thrown->translate(btVector3(0, btScalar(-0.05), 0));
  crossings.step(*impact.world);
  CHECK(crossings.vertex_face() + crossings.edge_edge() == 0);
  impact.thrown->translate(btVector3(0, -1, 0));
  crossings.step(*impact.world);
  CHECK(crossings.vertex_face() >= 36);
  CHECK(crossings.edge_edge() > 0);
  CHECK(impact.passed() == 36);
}

TEST_CASE("energy and momentum are those of the moving mass") {
  Impact impact(quiet_options(World::rigid), 3);
  const scenes::Mechanics m = scenes::measure(*impact.world);
  CHECK_THAT(m.kinetic_energy, Matchers::WithinAbs(4.5, 1e-4));
  CHECK_THAT(m.momentum[1], Matchers::WithinAbs(-3, 1e-4));
}

TEST_CASE("every scene runs in both worlds and is the same from the same seed") {
  const World world = GENERATE(World::rigid, World::deformable);
  for (const scenes::SceneInfo& info : scenes::all_scenes()) {
    CAPTURE(info.name);
    scenes::Parameters parameters;
    parameters.world = world;
    parameters.size = 0.3;
    std::vector<btScalar> first;
    for (int repeat = 0; repeat < 2; ++repeat) {
      scenes::Scene scene = scenes::set_up(info, parameters);
      CHECK(scene.steps > 0);
      for (int i = 0; i < 3; ++i) scene.world->step();
      const auto positions = scenes::read_positions(*scene.world);
      if (repeat == 0) first = positions;
      CHECK(positions == first);
    }
  }
}
