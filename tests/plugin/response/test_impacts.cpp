// Scenes in which bodies pass through with Bullet alone, at the parameters for which this was
// measured.
#include "plugin/support/worlds.h"
#include "scenes/run.h"
#include "support/catch.h"
#include "support/test_budget.h"

using namespace lazyccd;
using lazyccd::test::sweep;
using scenes::Collisions;
using scenes::World;

namespace {

struct Case {
  const char* scene;
  double speed, dt, margin;
};

scenes::RunReport run(const Case& c, World world, Collisions collisions) {
  scenes::Parameters parameters;
  parameters.world = world;
  parameters.collisions = collisions;
  parameters.speed = c.speed;
  parameters.dt = c.dt;
  if (c.margin > 0) parameters.margin = c.margin;
  scenes::Scene scene = scenes::set_up(*scenes::find_scene(c.scene), parameters);
  return scenes::run(scene);
}

void require_clean(const Case& c, World world) {
  CAPTURE(c.scene, c.speed, c.dt, c.margin, world == World::rigid);
  const scenes::RunReport report = run(c, world, Collisions::lazyccd);
  CHECK(report.finite);
  CHECK(report.crossings_vf == 0);
  CHECK(report.crossings_ee == 0);
  CHECK(report.intersections.empty());
  CHECK(report.wrong_side == 0);
  CHECK(report.lazyccd.contacts_vf + report.lazyccd.contacts_ee > 0);
  CHECK(report.lazyccd.fallback_steps == 0);
  // Impulses are enough in these scenes; the failsafe must not act.
  CHECK(report.lazyccd.failsafe_holds == 0);
}

}  // namespace

TEST_CASE("cloth thrown at a pinned cloth never passes through it") {
  const World world = GENERATE(World::rigid, World::deformable);
  const double dt = GENERATE(sweep({1.0 / 240, 1.0 / 60}));
  const double speed = GENERATE(sweep({2.0, 10.0, 30.0}));
  require_clean({"cloth-on-cloth", speed, dt, 0}, world);
}

TEST_CASE("cloth of centimetre triangles never passes through") {
  const World world = GENERATE(World::rigid, World::deformable);
  const double dt = GENERATE(sweep({1.0 / 240, 1.0 / 60}));
  require_clean({"small-triangles", 0.4, dt, 0}, world);
}

TEST_CASE("an edge never passes through an edge") {
  const World world = GENERATE(World::rigid, World::deformable);
  const double dt = GENERATE(1.0 / 60, 1.0 / 240);
  const double speed = GENERATE(1.0, 5.0);
  const double margin = GENERATE(0.01, 0.1);
  require_clean({"edge-on-edge", speed, dt, margin}, world);
}

TEST_CASE("a strip that closes on itself never passes through itself") {
  const World world = GENERATE(World::rigid, World::deformable);
  const double speed = GENERATE(sweep({1.0, 5.0}));
  CAPTURE(world == World::rigid, speed);
  const scenes::RunReport report = run({"fold", speed, 1.0 / 240, 0}, world, Collisions::lazyccd);
  CHECK(report.crossings_vf + report.crossings_ee == 0);
  CHECK(report.intersections.empty());
}

TEST_CASE("driven cloth stops before a body that was far away") {
  const World world_kind = GENERATE(World::rigid, World::deformable);
  scenes::WorldOptions options = test::quiet_options(world_kind, 1.0 / 60);
  const auto world = scenes::PhysicsWorld::make(options);
  auto lowest = test::sheet(*world, 9, 2, 0, 0), middle = test::sheet(*world, 6, 1, 0.3),
       highest = test::sheet(*world, 7, 1.2, 0.4);
  scenes::pin_border(*lowest, 9, 9);
  highest->setTotalMass(100);
  test::throw_down(*highest, 40);
  const btSoftBody &held = *lowest, &driven = *middle;
  for (auto* body : {&lowest, &middle, &highest}) world->add(std::move(*body));
  for (int step = 0; step < 20; ++step) {
    CAPTURE(world_kind == World::rigid, step);
    world->step();
    REQUIRE(scenes::nodes_below(driven, 0, driven.m_nodes.size() - 1, held) == 0);
  }
}

TEST_CASE("Bullet alone lets these scenes pass through, by the same counters") {
  SECTION("soft and rigid world, 30 m/s at 1/60 s") {
    const auto report = run({"cloth-on-cloth", 30, 1.0 / 60, 0}, World::rigid, Collisions::bullet);
    CHECK(report.wrong_side == 441);
    CHECK(report.crossings_vf > 0);
  }
  SECTION("deformable world, 30 m/s at 1/240 s") {
    const auto report =
        run({"cloth-on-cloth", 30, 1.0 / 240, 0}, World::deformable, Collisions::bullet);
    CHECK(report.wrong_side == 441);
    CHECK(report.crossings_ee > 0);
  }
  SECTION("deformable world, 2 m/s at 1/60 s: half of the cloth hangs in the net") {
    const auto report =
        run({"cloth-on-cloth", 2, 1.0 / 60, 0}, World::deformable, Collisions::bullet);
    CHECK(report.wrong_side > 100);
    CHECK(report.intersections.size() > 500);
  }
  SECTION("edge on edge, in both worlds") {
    const World world = GENERATE(World::rigid, World::deformable);
    const auto report = run({"edge-on-edge", 1, 1.0 / 240, 0.1}, world, Collisions::bullet);
    CHECK(report.wrong_side == 2);
    CHECK(report.crossings_ee > 0);
  }
#ifndef BT_USE_DOUBLE_PRECISION
  SECTION("centimetre triangles in single precision, in both worlds") {
    const World world = GENERATE(World::rigid, World::deformable);
    const auto report = run({"small-triangles", 0.4, 1.0 / 240, 0}, world, Collisions::bullet);
    CHECK(report.wrong_side == 441);
  }
#endif
}
