// Islands: what happens in one group of bodies changes nothing in another.
#include <algorithm>
#include <cmath>
#include <vector>

#include "plugin/support/worlds.h"
#include "scenes/meshes/cloth.h"
#include "scenes/meshes/shapes.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::bullet;
using namespace lazyccd::test;
using namespace lazyccd::scenes;

namespace {

constexpr double aside = 10;  // m, from one group to the other

void add_cloth(PhysicsWorld& world, double x, double height, double speed, unsigned seed) {
  std::mt19937 random(seed);
  Sheet sheet{9, 9, 1, 1};
  sheet.height = height;
  sheet.angle = 0.3 * seed;
  sheet.jitter = 0.002;
  auto cloth = make_sheet(world.info(), sheet, random);
  cloth->translate(vector(x, 0, 0));
  cloth->setVelocity(vector(0, -speed, 0));
  cloth->setSelfCollision(true);
  world.add(std::move(cloth));
}

// A few cloths that come to rest on a box, or on a floor, and a light ball that rolls off.
void add_quiet(PhysicsWorld& world, bool on_floor) {
  const double width = on_floor ? 4 * aside : 0.6;
  world.add_static(make_box(width, 0.4, width), at(0, -0.2, 0));
  for (unsigned i = 0; i < 3; ++i) add_cloth(world, 0, 0.04 * (i + 1), 0.3, i);
  world.add_dynamic(make_sphere(0.1), at(0.1, 0.3, 0), 0.05);
}

// Cloths that fly at each other and at what stands in their way.
void add_violent(PhysicsWorld& world) {
  world.add_static(make_sphere(0.3), at(aside, -0.3, 0));
  for (unsigned i = 0; i < 3; ++i) add_cloth(world, aside, 0.3 * (i + 1), 30, 5 + i);
  world.add_dynamic(make_box(0.3, 0.3, 0.3), at(aside, 0.16, 0), 0.2);
}

void append_positions(const PhysicsWorld& world, std::vector<btScalar>& positions) {
  for (int body = 0; body < 3; ++body) {
    const btSoftBody& cloth = *world.bodies()[body];
    for (int i = 0; i < cloth.m_nodes.size(); ++i)
      for (int k = 0; k < 3; ++k) positions.push_back(cloth.m_nodes[i].m_x[k]);
  }
}

// Positions of the first three cloths after each step.
std::vector<btScalar> quiet_positions(bool with_violent, bool on_floor, double restitution,
                                      int threads) {
  WorldOptions options = quiet_options(World::rigid, 1.0 / 120);
  options.gravity = 10;
  options.lazyccd.detector.threads = threads;
  options.lazyccd.restitution = restitution;
  options.lazyccd.restitution_threshold = 0.1;
  const auto world = PhysicsWorld::make(options);
  add_quiet(*world, on_floor);
  if (with_violent) add_violent(*world);
  std::vector<btScalar> positions;
  for (int step = 0; step < 60; ++step) {
    world->step();
    append_positions(*world, positions);
  }
  return positions;
}

enum class Change { none, static_body, dynamic_body, cloth };

// Positions of three cloths at rest in the steps after something was added beside them.
std::vector<btScalar> positions_after(Change change, World kind) {
  WorldOptions options = quiet_options(kind, 1.0 / 60);
  options.gravity = 10;
  const auto world = PhysicsWorld::make(options);
  // In the deformable world cloths that hang over an edge swing for long.
  const double width = kind == World::deformable ? 2 : 0.6;
  world->add_static(make_box(width, 0.4, width), at(0, -0.2, 0));
  for (unsigned i = 0; i < 3; ++i) add_cloth(*world, 0, 0.04 * (i + 1), 0.3, i);
  add_cloth(*world, aside, 0.5, 0, 7);
  std::vector<btScalar> positions;
  for (int step = 0; step < 155; ++step) {
    if (step == 150) {
      if (change == Change::static_body) world->add_static(make_sphere(0.1), at(aside, 0.6, 0));
      if (change == Change::dynamic_body)
        world->add_dynamic(make_sphere(0.1), at(aside, 0.7, 0), 0.1);
      if (change == Change::cloth) add_cloth(*world, aside, 3, 0, 8);
    }
    world->step();
    if (step >= 150) append_positions(*world, positions);
  }
  return positions;
}

}  // namespace

TEST_CASE("bodies move the same to the bit, whatever happens far away from them") {
  const int threads = GENERATE(1, 3);
  const bool on_floor = GENERATE(false, true);  // both groups lie on it
  const double restitution = GENERATE(0.0, 0.5);
  CAPTURE(on_floor, restitution);
  const std::vector<btScalar> alone = quiet_positions(false, on_floor, restitution, threads);
  CHECK(quiet_positions(true, on_floor, restitution, threads) == alone);
}

TEST_CASE("bodies at rest stay at rest when something is added elsewhere") {
  const World kind = GENERATE(World::rigid, World::deformable);
  const Change change = GENERATE(Change::static_body, Change::dynamic_body, Change::cloth);
  CAPTURE(kind, change);
  const std::vector<btScalar> alone = positions_after(Change::none, kind);
  const std::vector<btScalar> beside = positions_after(change, kind);
  REQUIRE(alone.size() == beside.size());
  double largest = 0;
  for (std::size_t i = 0; i < alone.size(); ++i)
    largest = std::max(largest, std::abs(static_cast<double>(alone[i] - beside[i])));
  CHECK(largest < 2e-5);
}
