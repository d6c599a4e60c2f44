// Scenes with ropes, and with a strip of cloth that is twisted into one.
#include <cmath>

#include "scenes/measures/sides.h"
#include "scenes/meshes/cloth.h"
#include "scenes/meshes/shapes.h"
#include "scenes/meshes/solid.h"
#include "scenes/scene.h"

namespace lazyccd::scenes {
namespace {

// A rope along x, pinned at both ends, and a rope along z that flies at it.
void build_crossing_ropes(Scene& scene, const Parameters& parameters, double speed) {
  PhysicsWorld& world = *scene.world;
  const int nodes = scaled(41, parameters);
  auto held = make_rope(world.info(), nodes, 1, vector(-1, 0, 0.01), vector(1, 0, 0.01));
  auto thrown = make_rope(world.info(), scaled(31, parameters), 0.7, vector(0.013, 0.2, -0.7),
                          vector(0.013, 0.2, 0.8));
  pin(*held, 0, 0);
  pin(*held, nodes - 1, nodes - 1);
  thrown->setVelocity(vector(0, -speed, 0));
  world.add(std::move(held));
  world.add(std::move(thrown));
}

void build_rope_on_cloth(Scene& scene, const Parameters& parameters, double speed) {
  PhysicsWorld& world = *scene.world;
  std::mt19937 random(parameters.seed);
  const int nodes = scaled(21, parameters);
  Sheet sheet{nodes, nodes, 1, 1};
  sheet.jitter = 0.002;
  auto cloth = make_sheet(world.info(), sheet, random);
  pin_border(*cloth, nodes, nodes);
  auto rope = make_rope(world.info(), scaled(25, parameters), 0.5, vector(-0.35, 0.2, -0.3),
                        vector(0.37, 0.25, 0.32));
  rope->setVelocity(vector(0, -speed, 0));
  const btSoftBody *below = cloth.get(), *above = rope.get();
  world.add(std::move(cloth));
  world.add(std::move(rope));
  scene.nodes_on_wrong_side = [=] {
    return nodes_below(*above, 0, above->m_nodes.size() - 1, *below);
  };
}

constexpr double twist_width = 0.16, twist_length = 1.2;  // m
constexpr double turns = 5;                               // of each end, in opposite directions
constexpr double half_turn = 3.14159265358979323846;      // radians

// A strip whose ends turn in opposite directions. `speed` is the speed of its corners.
void build_twist(Scene& scene, const Parameters& parameters, double speed) {
  PhysicsWorld& world = *scene.world;
  const int columns = scaled(9, parameters), rows = scaled(61, parameters);
  std::mt19937 random(parameters.seed);
  Sheet sheet{columns, rows, twist_width, twist_length};
  sheet.jitter = 0.001;
  auto strip = make_sheet(world.info(), sheet, random);
  strip->setSelfCollision(true);
  btSoftBody* body = strip.get();
  std::vector<btVector3> held;
  for (const int first : {0, columns * (rows - 1)}) {
    pin(*strip, first, first + columns - 1);
    for (int i = first; i < first + columns; ++i) held.push_back(strip->m_nodes[i].m_x);
  }
  world.add(std::move(strip));
  const double rate = speed / (twist_width / 2), last = 2 * half_turn * turns;
  world.drive([=, dt = world.options().dt](double time) {
    const double angle = std::min(rate * time, last);
    for (int i = 0; i < 2 * columns; ++i) {
      const bool far_end = i >= columns;
      const btVector3 goal =
          held[i].rotate(vector(0, 0, 1), static_cast<btScalar>(far_end ? angle : -angle));
      steer(body->m_nodes[far_end ? columns * (rows - 2) + i : i], goal, dt);
    }
  });
}

}  // namespace

std::vector<SceneInfo> rope_scenes() {
  SceneInfo ropes;
  ropes.name = "crossing-ropes";
  ropes.description = "a rope flies across another rope that is pinned at its ends";
  ropes.speed = 5;
  ropes.distance = 0.3;
  ropes.seconds = 0.2;
  ropes.build = build_crossing_ropes;

  SceneInfo rope_on_cloth = ropes;
  rope_on_cloth.name = "rope-on-cloth";
  rope_on_cloth.description = "a rope flies into a cloth that is pinned along its border";
  rope_on_cloth.build = build_rope_on_cloth;

  SceneInfo twist;
  twist.name = "twist";
  twist.description =
      "the two ends of a strip of cloth turn in opposite directions, five times each";
  twist.speed = 1;
  twist.distance = turns * half_turn * twist_width;
  twist.seconds = 0.2;
  twist.margin = 0.002;
  twist.build = build_twist;
  return {ropes, rope_on_cloth, twist};
}

}  // namespace lazyccd::scenes
