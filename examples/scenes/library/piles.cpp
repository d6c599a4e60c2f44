// Scenes in which cloths come to rest on rigid bodies and on each other.
#include "scenes/meshes/cloth.h"
#include "scenes/meshes/shapes.h"
#include "scenes/scene.h"

namespace lazyccd::scenes {
namespace {

void build_stack(Scene& scene, const Parameters& parameters, double speed, int count) {
  std::mt19937 random(parameters.seed);
  PhysicsWorld& world = *scene.world;
  world.add_static(make_box(0.6, 0.4, 0.6), at(0, -0.2, 0));
  for (int i = 0; i < count; ++i) {
    const int nodes = scaled(15, parameters);
    Sheet sheet{nodes, nodes, 1, 1};
    sheet.height = 0.06 * (i + 1);
    sheet.angle = 0.1 * i;
    sheet.jitter = 0.002;
    auto cloth = make_sheet(world.info(), sheet, random);
    cloth->setVelocity(vector(0, -speed, 0));
    world.add(std::move(cloth));
  }
}

void build_drop(Scene& scene, const Parameters& parameters, double) {
  std::mt19937 random(parameters.seed);
  PhysicsWorld& world = *scene.world;
  world.add_static(make_box(1.6, 0.1, 1.6), at(0, -0.05, 0));
  world.add_static(make_sphere(0.3), at(0, 0.3, 0));
  for (int i = 0; i < 2; ++i) {
    const int nodes = scaled(i == 0 ? 33 : 29, parameters);
    Sheet sheet{nodes, nodes, 1.4, 1.4};
    sheet.width = sheet.length = i == 0 ? 1.4 : 1.2;
    sheet.height = 0.7 + 0.1 * i;
    sheet.angle = 0.2 + 0.6 * i;
    sheet.jitter = 0.002;
    auto cloth = make_sheet(world.info(), sheet, random);
    cloth->setSelfCollision(true);
    world.add(std::move(cloth));
  }
}

}  // namespace

std::vector<SceneInfo> pile_scenes() {
  SceneInfo eight;
  eight.name = "eight-cloths";
  eight.description = "eight cloths, 6 cm apart, fall on a box";
  eight.gravity = 10;
  eight.seconds = 2;
  eight.build = [](Scene& scene, const Parameters& p, double speed) {
    build_stack(scene, p, speed, 8);
  };

  SceneInfo twenty = eight;
  twenty.name = "twenty-cloths";
  twenty.description = "twenty cloths, 6 cm apart, fall on a box";
  twenty.seconds = 3;
  twenty.build = [](Scene& scene, const Parameters& p, double speed) {
    build_stack(scene, p, speed, 20);
  };

  SceneInfo drop;
  drop.name = "drop";
  drop.description = "two cloths with self-collision fall on a ball and a table";
  drop.gravity = 10;
  drop.seconds = 1.5;
  drop.build = build_drop;
  return {eight, twenty, drop};
}

}  // namespace lazyccd::scenes
