#include "scenes.h"

#include <BulletCollision/CollisionShapes/btCapsuleShape.h>

#include <algorithm>
#include <cmath>

#include "scenes/meshes/cloth.h"
#include "scenes/meshes/shapes.h"
#include "scenes/meshes/solid.h"

namespace lazyccd::web {

using namespace scenes;

namespace {

constexpr double pi = 3.14159265358979324;

// Two cloths of 31 x 31 nodes fall on a ball, one after the other.
void build_cloths_on_ball(Scene& scene, const Parameters& parameters, double speed) {
  PhysicsWorld& world = *scene.world;
  std::mt19937 random(parameters.seed);
  world.add_static(make_sphere(0.35), at(0, 0, 0));
  world.add_static(make_box(4, 0.2, 4), at(0, -0.7, 0));
  const int nodes = scaled(31, parameters);
  for (const double height : {0.45, 0.65}) {
    Sheet sheet{nodes, nodes, 1.2, 1.2};
    sheet.height = height;
    sheet.angle = height;
    sheet.jitter = 0.002;
    sheet.mass = 0.3;
    auto cloth = make_sheet(world.info(), sheet, random);
    cloth->setVelocity(vector(0, -speed, 0));
    world.add(std::move(cloth));
  }
}

// A skirt hangs from a waist. The waist and two legs go to and fro, the legs in turn.
void build_skirt(Scene& scene, const Parameters& parameters, double speed) {
  PhysicsWorld& world = *scene.world;
  const int columns = scaled(36, parameters), rows = scaled(16, parameters);
  const auto at_waist = [](double turn, double down) {
    const double radius = 0.25 + 0.12 * down;
    return vector(radius * std::cos(turn), -0.7 * down, radius * std::sin(turn));
  };
  std::vector<btVector3> positions;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      positions.push_back(at_waist(2 * pi * column / columns, row / (rows - 1.0)));
  const std::vector<btScalar> masses(positions.size(),
                                     static_cast<btScalar>(0.4 / (columns * rows)));
  auto skirt =
      std::make_unique<btSoftBody>(&world.info(), columns * rows, positions.data(), masses.data());
  skirt->appendMaterial();
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const int a = row * columns + column, b = row * columns + (column + 1) % columns;
      skirt->appendLink(a, b);
      if (row + 1 == rows) continue;
      skirt->appendLink(a, a + columns);
      skirt->appendLink(a, b + columns);
      skirt->appendFace(a, b, b + columns);
      skirt->appendFace(a, b + columns, a + columns);
    }
  }
  pin(*skirt, 0, columns - 1);
  btSoftBody* const cloth = skirt.get();
  world.add(std::move(skirt));

  // 0 at rest, then from -1 to 1 and back. All begins to move within half a second.
  const auto wave = [speed](double time) {
    return std::min(1.0, 2 * time) * std::sin(speed / 0.3 * time);
  };
  // The waist moves by 0.3 m to both sides, about as fast as `speed`.
  const auto sway = [wave](double time) { return 0.3 * wave(time); };
  world.drive([=, &world](double time) {
    for (int i = 0; i < columns; ++i)
      steer(cloth->m_nodes[i], at_waist(2 * pi * i / columns, 0) + vector(sway(time), 0, 0),
            world.options().dt);
  });
  for (const double side : {-1.0, 1.0}) {
    world.add_moving(
        std::make_unique<btCapsuleShape>(btScalar(0.09), btScalar(0.7)), [=](double time) {
          const double swing = 0.5 * side * wave(time);
          btTransform pose(btQuaternion(btVector3(1, 0, 0), static_cast<btScalar>(swing)));
          const btVector3 hip = vector(sway(time) + 0.12 * side, 0, 0);
          pose.setOrigin(hip + pose.getBasis() * vector(0, -0.4, 0));
          return pose;
        });
  }
}

// Ten soft boxes fall on the ground and on each other.
void build_boxes(Scene& scene, const Parameters& parameters, double speed) {
  PhysicsWorld& world = *scene.world;
  world.add_static(make_box(4, 0.2, 4), at(0, -0.1, 0));
  const int cells = scaled(3, parameters);
  for (int i = 0; i < 10; ++i) {
    const double half = 0.1, angle = 0.7 * i;
    const double x = 0.08 * std::cos(2.1 * i), y = 0.25 + 0.27 * i, z = 0.08 * std::sin(2.1 * i);
    const double c = std::cos(angle), s = std::sin(angle);
    auto box = make_solid(world.info(), cells, 0.5, [&](double u, double v, double w) {
      const double dx = 2 * half * (u - 0.5), dz = 2 * half * (w - 0.5);
      return vector(x + c * dx + s * dz, y + 2 * half * (v - 0.5), z + c * dz - s * dx);
    });
    box->setVelocity(vector(0, -speed, 0));
    world.add(std::move(box));
  }
}

SceneInfo info_of(const char* name, double speed, double gravity, double margin,
                  void (*build)(Scene&, const Parameters&, double)) {
  SceneInfo info;
  info.name = name;
  info.speed = speed;
  info.gravity = gravity;
  info.margin = margin;
  info.build = build;
  return info;
}

}  // namespace

std::vector<SceneInfo> page_scenes() {
  return {info_of("cloths-on-ball", 2, 10, 0.01, build_cloths_on_ball),
          *find_scene("cloth-on-cloth"), *find_scene("ball-on-net"),
          info_of("skirt", 1, 10, 0.01, build_skirt), info_of("boxes", 1, 10, 0.01, build_boxes)};
}

Scene set_up(const SceneInfo& info, Collisions collisions, double speed, double size) {
  Parameters parameters;
  parameters.world = World::rigid;
  parameters.collisions = collisions;
  parameters.dt = 1.0 / 60;
  parameters.speed = speed;
  parameters.size = size;
  parameters.lazyccd.detector.threads = 1;
  return scenes::set_up(info, parameters);
}

}  // namespace lazyccd::web
