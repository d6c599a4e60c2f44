// Bodies that start exactly at each other's surface, or inside by less than rounding.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "plugin/support/obstacle_worlds.h"
#include "random/penetration_check.h"
#include "random/touching_start.h"
#include "scenes/meshes/solid.h"
#include "support/catch.h"
#include "support/test_budget.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::World;

namespace {

bullet::SolverOptions one_thread() {
  bullet::SolverOptions options;
  options.detector.threads = 1;
  return options;
}

double step_of(World world) { return world == World::rigid ? 1.0 / 60 : 1.0 / 240; }

std::unique_ptr<btSoftBody> level_cloth(btSoftBodyWorldInfo& info, int nodes, double height) {
  return scenes::make_cloth(info, nodes, nodes, 0.2, [&](double u, double v) {
    return btVector3(static_cast<btScalar>(u - 0.5), static_cast<btScalar>(height),
                     static_cast<btScalar>(v - 0.5));
  });
}

struct Rest {
  double lowest, highest,
      fastest;  // of the nodes: metres above the box at the end; m/s in any step
};

// A cloth of nodes x nodes at `gap` above the face of a box at the height `top`.
Rest rest_on_box(World kind, int nodes, double top, double gap) {
  ObstacleWorld world(kind, 9.81, one_thread());
  world.add(std::make_unique<btBoxShape>(btVector3(5, btScalar(0.5), 5)),
            btVector3(0, static_cast<btScalar>(top - 0.5), 0), 0, 0.04);
  btSoftBody* const cloth = world.add(level_cloth(world.info(), nodes, top + gap), 0.02);
  Rest rest = {1e9, -1e9, 0};
  for (int i = 0; i < static_cast<int>(0.5 / step_of(kind)); ++i) {
    world.steps(1, step_of(kind));
    for (int k = 0; k < cloth->m_nodes.size(); ++k)
      rest.fastest = std::max(rest.fastest, static_cast<double>(cloth->m_nodes[k].m_v.length()));
  }
  for (int k = 0; k < cloth->m_nodes.size(); ++k) {
    const double height = static_cast<double>(cloth->m_nodes[k].m_x.y()) -
                          static_cast<double>(static_cast<btScalar>(top));
    rest.lowest = std::min(rest.lowest, height);
    rest.highest = std::max(rest.highest, height);
  }
  return rest;
}

std::int64_t intersections_of(const PenetrationCheck::SoftBodies& bodies) {
  PenetrationCheck check;
  check.restart(bodies, {});
  return check.intersections().sum();
}

std::unique_ptr<scenes::PhysicsWorld> weightless_world(World world) {
  scenes::WorldOptions options;
  options.world = world;
  options.margin = 0.02;
  options.dt = step_of(world);
  return scenes::PhysicsWorld::make(options);
}

double fastest_of(const btSoftBody& body) {
  double fastest = 0;
  for (int k = 0; k < body.m_nodes.size(); ++k)
    fastest = std::max(fastest, static_cast<double>(body.m_nodes[k].m_v.length()));
  return fastest;
}

}  // namespace

TEST_CASE("cloth that starts exactly on a box rests on it, without a kick") {
  const World world = GENERATE(World::rigid, World::deformable);
  const int nodes = GENERATE(2, 5);
  for (const double top : {0.0, 0.05, 0.1, 0.3, 0.7, 1.1, 10.0, 1000.0}) {
    CAPTURE(world == World::rigid, nodes, top);
    const Rest rest = rest_on_box(world, nodes, top, 0);
    CHECK(rest.lowest > 0);
    CHECK(rest.highest < 0.06);
    CHECK(rest.fastest < 0.3);
  }
}

TEST_CASE("cloth inside of a box by less than rounding rests on it") {
  const World world = GENERATE(World::rigid, World::deformable);
  constexpr double ulp = static_cast<double>(std::numeric_limits<btScalar>::epsilon());
  for (const double top : {0.0, 1.0, 100.0, 1000.0}) {
    for (const double gap : {-1e-9, -1e-7, -0.5 * ulp * top, -4 * ulp * top, -16 * ulp * top}) {
      CAPTURE(world == World::rigid, top, gap);
      const Rest rest = rest_on_box(world, 2, top, gap);
      CHECK(rest.lowest > 0);
      CHECK(rest.fastest < 0.3);
    }
  }
}

TEST_CASE("what untangling pushes out of a box ends outside") {
  const World world = GENERATE(World::rigid, World::deformable);
  // One step pushes 8.333 mm at 120 steps a second, and a few micrometres are left.
  for (const double gap : {-0.008334, -0.0083333, -0.0166667, -0.004167}) {
    CAPTURE(world == World::rigid, gap);
    CHECK(rest_on_box(world, 5, 0, gap).lowest > 0);
  }
}

TEST_CASE("soft cubes whose faces coincide part, and nothing sticks") {
  const auto cube = [](btSoftBodyWorldInfo& info, double x, int cells) {
    return scenes::make_solid(info, cells, 1, [&](double u, double v, double w) {
      return btVector3(static_cast<btScalar>(x + u), static_cast<btScalar>(v),
                       static_cast<btScalar>(w));
    });
  };
  const World world = GENERATE(World::rigid, World::deformable);
  const int cells = GENERATE(1, 3);
  CAPTURE(world == World::rigid, cells);
  const auto w = weightless_world(world);
  w->add(cube(w->info(), 0, cells));
  w->add(cube(w->info(), 1, 2));
  for (int i = 0; i < 60; ++i) {
    w->step();
    REQUIRE(intersections_of(w->bodies()) == 0);
    for (const auto& body : w->bodies()) REQUIRE(fastest_of(*body) < 0.3);
  }
}

TEST_CASE("cloths at the same place part to one side each") {
  const World world = GENERATE(World::rigid, World::deformable);
  const int nodes = GENERATE(2, 13);
  CAPTURE(world == World::rigid, nodes);
  const auto w = weightless_world(world);
  w->add(level_cloth(w->info(), nodes, 0));
  w->add(level_cloth(w->info(), nodes, 0));
  for (int i = 0; i < 60; ++i) w->step();
  CHECK(intersections_of(w->bodies()) == 0);
  CHECK(w->total_stats()->initial_contacts == 0);
  const auto& a = w->bodies()[0]->m_nodes;
  const auto& b = w->bodies()[1]->m_nodes;
  const bool first_is_above = a[0].m_x.y() > b[0].m_x.y();
  for (int k = 0; k < a.size(); ++k) CHECK((a[k].m_x.y() > b[k].m_x.y()) == first_is_above);
}

TEST_CASE("bodies closer than their thickness part slowly, at the same rate for any time step") {
  // The gap that is missing shrinks by the rate of position correction.
  const auto gap_after = [](double dt, double seconds) {
    ObstacleWorld world(World::rigid, 0, one_thread());
    world.add(std::make_unique<btBoxShape>(btVector3(5, btScalar(0.5), 5)),
              btVector3(0, btScalar(-0.5), 0), 0, 0.04);
    const btSoftBody* const cloth = world.add(level_cloth(world.info(), 4, 0.01), 0.06);
    world.steps(static_cast<int>(std::lround(seconds / dt)), dt);
    CHECK(fastest_of(*cloth) < 1e-3);
    return static_cast<double>(cloth->m_nodes[5].m_x.y());
  };
  // The margin of a box is inside of it.
  const double half_thickness = 0.03, rate = bullet::SolverOptions().position_correction;
  const double expected = half_thickness - 0.02 * std::exp(-0.5 * rate);
  CHECK_THAT(gap_after(1.0 / 60, 0.5), Matchers::WithinRel(expected, 0.02));
  CHECK_THAT(gap_after(1.0 / 1000, 0.5), Matchers::WithinRel(expected, 0.02));
}

TEST_CASE("position correction does not lift what rests") {
  const World world = GENERATE(World::rigid, World::deformable);
  for (const double gap : {1e-5, 1e-3}) {
    CAPTURE(world == World::rigid, gap);
    const Rest rest = rest_on_box(world, 5, 0, gap);
    CHECK(rest.highest < gap + 1e-4);
    CHECK(rest.lowest > 0);
  }
}

// The triangles of the plane are large and tilted, so that its gaps are rounded most.
TEST_CASE("a body whose masses change stays on its side of what it touches") {
  const World kind = GENERATE(World::rigid, World::deformable);
  const double side = GENERATE(1.0, -1.0);  // above the plane, or below it, where it stays too
  CAPTURE(kind == World::rigid, side);
  bullet::SolverOptions options = one_thread();
  options.untangling_speed = 0;
  ObstacleWorld world(kind, 0, options);
  const btVector3 normal = btVector3(3, 4, 1).normalized();
  world.add(std::make_unique<btStaticPlaneShape>(normal, btScalar(0)), btVector3(0, 0, 0), 0, 0);
  const btVector3 u_axis = normal.cross(btVector3(0, 0, 1)).normalized(),
                  v_axis = normal.cross(u_axis);
  const auto cloth_at = [&](double height) {
    return scenes::make_cloth(world.info(), 5, 5, 0.2, [=](double u, double v) {
      return static_cast<btScalar>(u) * u_axis + static_cast<btScalar>(v) * v_axis +
             static_cast<btScalar>(height) * normal;
    });
  };
  btSoftBody* const cloth = world.add(cloth_at(0.01 * side), 0);
  btSoftBody* const far_away = world.add(cloth_at(100), 0);  // makes the triangle large
  for (int i = 0; i < 30; ++i) {
    cloth->setVelocity(static_cast<btScalar>(-side) * normal);
    far_away->setVelocity(50 * v_axis);
    world.steps(1, 1.0 / 240);
    cloth->setTotalMass(static_cast<btScalar>(0.2 + 0.01 * i));
  }
  for (int k = 0; k < cloth->m_nodes.size(); ++k)
    CHECK(side * static_cast<double>(normal.dot(cloth->m_nodes[k].m_x)) > -1e-6);
}

TEST_CASE("random starts at a distance of zero") {
  const std::uint32_t count = is_sanitized ? 20 : 200;
  for (std::uint32_t number = 1; number <= count; ++number) {
    const World world = number % 2 == 0 ? World::rigid : World::deformable;
    const StartReport alone = run_touching_start(number, world, scenes::Collisions::bullet);
    const StartReport start = run_touching_start(number, world, scenes::Collisions::lazyccd);
    CAPTURE(number, start.what);
    CHECK(faults_of(start, alone) == "");
  }
}
