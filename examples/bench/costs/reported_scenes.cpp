// Scenes after those that users reported as slow.
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>

#include <cmath>
#include <functional>
#include <memory>
#include <utility>

#include "bench/costs/cost_scenes.h"
#include "scenes/meshes/cloth.h"
#include "scenes/meshes/solid.h"

namespace lazyccd::scenes {
namespace {

btSoftBody& add_sheet(PhysicsWorld& world, int nodes, double width, double mass,
                      const btVector3& middle) {
  auto made = make_cloth(world.info(), nodes, nodes, mass, [=](double u, double v) {
    return middle + vector((u - 0.5) * width, 0, (v - 0.5) * width);
  });
  btSoftBody& sheet = *made;
  world.add(std::move(made));
  return sheet;
}

btSoftBody& add_pinned_sheet(PhysicsWorld& world, int nodes) {
  btSoftBody& sheet = add_sheet(world, nodes, 2, 0.5, vector(0, 1, 0));
  for (const int corner : {0, nodes - 1, nodes * (nodes - 1), nodes * nodes - 1})
    sheet.setMass(corner, 0);
  return sheet;
}

void put_box_on_pinned_cloth(PhysicsWorld& world) {
  add_pinned_sheet(world, 17);
  world.add_dynamic(make_box(0.3, 0.3, 0.3), at(0.1, 1.3, 0), 0.5);
}

// Every half a second something falls on a pinned cloth: a box or a small cloth.
void add_things_to_pinned_cloth(PhysicsWorld& world) {
  add_pinned_sheet(world, 17);
  world.add_static(make_box(10, 1, 10), at(0, -1, 0));
  constexpr double interval = 0.5;
  world.drive([&world, added = 0](double time) mutable {
    if (time < interval * added) return;
    const double x = 0.3 * (added % 3 - 1), z = 0.2 * (added % 2);
    if (added % 2 == 0) {
      world.add_dynamic(make_box(0.2, 0.2, 0.2), at(x, 1.8, z), 0.2);
    } else {
      add_sheet(world, 6, 0.4, 0.05, vector(x, 1.7, z));
    }
    ++added;
  });
}

// A tube of cloth, held at its upper rim, round two capsules that walk.
void walk_in_skirt(PhysicsWorld& world) {
  constexpr int around = 24, rows = 9;
  constexpr double pi = 3.14159265358979323846;
  auto skirt = make_cloth(world.info(), around, rows, 0.3, [](double u, double v) {
    const double angle = 2 * pi * u * (around - 1) / around, radius = 0.25 + 0.1 * v;
    return vector(radius * std::cos(angle), 1 - 0.6 * v, radius * std::sin(angle));
  });
  for (int row = 0; row < rows; ++row) {  // closes the seam
    const int first = row * around, last = first + around - 1;
    skirt->appendLink(first, last);
    if (row + 1 == rows) continue;
    skirt->appendFace(last, last + around, first + around);
    skirt->appendFace(last, first + around, first);
  }
  for (int node = 0; node < around; ++node) skirt->setMass(node, 0);
  world.add(std::move(skirt));
  for (const double side : {-1.0, 1.0}) {
    world.add_moving(
        std::make_unique<btCapsuleShape>(btScalar(0.07), btScalar(0.7)), [side](double time) {
          const double swing = 0.3 * side * std::sin(4 * time);
          btTransform pose = at(0.11 * side, 0.6, 0.4 * swing);
          pose.setRotation(btQuaternion(vector(1, 0, 0), static_cast<btScalar>(-swing)));
          return pose;
        });
  }
}

void drop_cloth_on_box(PhysicsWorld& world) {
  world.add_static(make_box(0.6, 0.6, 0.6), at(0, 0, 0));
  add_sheet(world, 21, 1, 0.5, vector(0, 0.6, 0));
}

void put_box_on_soft_ball(PhysicsWorld& world) {
  world.add_static(make_box(10, 1, 10), at(0, -0.5, 0));
  world.add(make_ball(world.info(), 4, 1, vector(0, 0.35, 0), 0.3));
  world.add_dynamic(make_box(0.4, 0.2, 0.4), at(0, 0.9, 0), 0.5);
}

// Soft balls as Bullet's own helper makes them, without pressure: bags with edges of many lengths.
void drop_bags_into_box(PhysicsWorld& world) {
  world.add_static(make_box(10, 1, 10), at(0, -0.5, 0));
  for (const double side : {-1.0, 1.0}) {
    world.add_static(make_box(0.2, 4, 2), at(0.7 * side, 2, 0));
    world.add_static(make_box(2, 4, 0.2), at(0, 2, 0.7 * side));
  }
  for (int i = 0; i < 16; ++i) {
    const btVector3 place = vector(i % 2 == 0 ? 0.3 : -0.3, 0.4 + 0.5 * (i / 4),  //
                                   i / 2 % 2 == 0 ? 0.3 : -0.3);
    std::unique_ptr<btSoftBody> bag(
        btSoftBodyHelpers::CreateEllipsoid(world.info(), place, vector(0.2, 0.2, 0.2), 64));
    bag->setTotalMass(btScalar(0.2), true);
    bag->m_materials[0]->m_kLST = btScalar(0.5);
    world.add(std::move(bag));
  }
}

}  // namespace

std::vector<CostScene> reported_scenes() {
  std::vector<CostScene> scenes;
  const auto add = [&scenes](const char* name, double seconds,
                             std::function<void(PhysicsWorld&)> build) {
    CostScene scene;
    scene.name = name;
    scene.build = std::move(build);
    scene.seconds = seconds;
    scene.margin = 0.02;
    scenes.push_back(std::move(scene));
  };
  add("box on a pinned cloth", 2, put_box_on_pinned_cloth);
  add("boxes and cloths fall on a pinned cloth", 4, add_things_to_pinned_cloth);
  add("skirt round walking legs", 2, walk_in_skirt);
  add("cloth of 21 x 21 on a box", 2, drop_cloth_on_box);
  add("box on a soft ball", 4, put_box_on_soft_ball);
  add("sixteen bags in a box", 6, drop_bags_into_box);
  return scenes;
}

}  // namespace lazyccd::scenes
