// Measures how far contacts stretch the links of cloths and ropes, in the rigid world, with Bullet
// alone and with LazyCCD.
//
//   lazyccd_stretch                  all scenes, sizes and steps; a table
//   lazyccd_stretch --scene rollers  one of them
//
// Exit code 1 if a link gets longer than its bound, and than with Bullet alone. Lengths are
// multiples of the rest length: the longest of the whole run, and that at the end.
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "scenes/meshes/cloth.h"
#include "scenes/meshes/shapes.h"
#include "scenes/meshes/solid.h"
#include "scenes/worlds/physics_world.h"

using namespace lazyccd::scenes;

namespace {

// What differs between the runs of a scene.
struct Variant {
  int nodes;      // along a side, or of a rope
  double amount;  // speed in m/s, or mass over that of the soft body
};

struct StretchScene {
  std::string name;
  double bound;  // longest link over its rest length, at 1/60 s and finer
  double seconds;
  std::vector<Variant> variants;
  std::function<void(PhysicsWorld&, const Variant&)> build;
};

btSoftBody& add(PhysicsWorld& world, std::unique_ptr<btSoftBody> made, int iterations) {
  btSoftBody& body = *made;
  world.add(std::move(made));
  body.m_materials[0]->m_kLST = 1;
  body.m_cfg.piterations = iterations;
  body.m_cfg.kDP = 0;
  body.setActivationState(DISABLE_DEACTIVATION);
  return body;
}

btSoftBody& add_cloth(PhysicsWorld& world, int nodes, double width, double height, double mass,
                      int iterations = 4) {
  return add(world,
             make_cloth(world.info(), nodes, nodes, mass,
                        [=](double u, double v) {
                          return vector((u - 0.5) * width, height, (v - 0.5) * width);
                        }),
             iterations);
}

void add_ball(PhysicsWorld& world, double radius) {
  world.add_static(std::make_unique<btSphereShape>(static_cast<btScalar>(radius)), at(0, 0, 0));
}

void fall_on_ball(PhysicsWorld& world, const Variant& variant, double size) {
  add_ball(world, 0.3 * size);
  add_cloth(world, variant.nodes, size, 0.4 * size, 0.2 * size * size);
}

void hit_ball(PhysicsWorld& world, const Variant& variant) {
  add_ball(world, 0.3);
  add_cloth(world, variant.nodes, 1, 0.4, 0.2, 10).setVelocity(vector(0, -variant.amount, 0));
}

// A weight falls on a cloth whose corners are pinned.
void carry(PhysicsWorld& world, const Variant& variant) {
  constexpr double mass = 0.1;
  btSoftBody& cloth = add_cloth(world, variant.nodes, 2, 0, mass);
  for (const int corner : {0, variant.nodes - 1, variant.nodes * (variant.nodes - 1),
                           variant.nodes * variant.nodes - 1})
    cloth.setMass(corner, 0);
  world.add_dynamic(make_box(0.4, 0.4, 0.4), at(0, 0.3, 0), variant.amount * mass);
}

// Three turns of a rope round a pole, with a weight at one end and a pinned node at the other.
void hold_by_pole(PhysicsWorld& world, const Variant& variant) {
  constexpr double radius = 0.1, around = radius + 0.015, tail = 0.5;
  auto shape = std::make_unique<btCylinderShapeZ>(vector(radius, radius, 1));
  world.add_static(std::move(shape), at(0, 0, 0));
  world.rigid_bodies().back().body->setFriction(btScalar(0.5));
  btSoftBody& added =
      add(world, make_wound_rope(world.info(), variant.nodes, 0.1, around, 3, 0.05, tail), 10);
  added.setMass(variant.nodes - 1, 0);
  btRigidBody& weight =
      world.add_dynamic(make_box(0.1, 0.1, 0.1), at(around, -tail - 0.05, 0), 0.1 * variant.amount);
  added.appendAnchor(0, &weight, true);
}

// A cloth between two rollers that turn. They close in on it first.
void roll(PhysicsWorld& world, const Variant& variant) {
  constexpr double radius = 0.1, gap = 0.02, open = 0.05;
  add(world,
      make_cloth(world.info(), variant.nodes, 2 * variant.nodes + 1, 0.1,
                 [](double u, double v) { return vector(0.4 * (u - 0.5), 0, v - 0.95); }),
      4);
  for (const double side : {1.0, -1.0}) {
    world.add_moving(
        std::make_unique<btCylinderShapeX>(vector(0.3, radius, radius)), [=](double time) {
          const double away = open + (gap / 2 - open) * std::min(1.0, time);
          btTransform pose = at(0, side * (radius + away), 0);
          const double turned = variant.amount * std::max(0.0, time - 1);
          pose.setRotation(btQuaternion(vector(1, 0, 0), static_cast<btScalar>(side * turned)));
          return pose;
        });
  }
  world.add_static(make_box(0.6, 0.04, 0.6), at(0, -0.03, -0.5));
}

// A cloth that lies on a box is pulled over its edge by a side of pinned nodes.
void pull_over_edge(PhysicsWorld& world, const Variant& variant) {
  world.add_static(make_box(1, 1, 1), at(0, -0.52, 0));
  const int nodes = variant.nodes;
  btSoftBody& cloth = add_cloth(world, nodes, 0.9, 0, 0.2);
  for (int i = 0; i < nodes; ++i) cloth.setMass(i * nodes + nodes - 1, 0);
  const double dt = world.options().dt, speed = variant.amount;
  world.drive([&cloth, nodes, dt, speed](double time) {
    for (int i = 0; i < nodes; ++i) {
      btSoftBody::Node& node = cloth.m_nodes[i * nodes + nodes - 1];
      const double x = 0.45 + speed * std::max(0.0, time - 0.2);
      steer(node,
            vector(std::min(x, 0.6), -std::max(0.0, x - 0.6), 0.9 * (i / (nodes - 1.0) - 0.5)), dt);
    }
  });
}

// A cloth lies on a plate that starts to spin.
void spin(PhysicsWorld& world, const Variant& variant) {
  world.add_moving(make_box(2, 0.2, 2), [rate = variant.amount](double time) {
    btTransform pose = at(0, -0.11, 0);
    pose.setRotation(btQuaternion(vector(0, 1, 0), static_cast<btScalar>(rate * time)));
    return pose;
  });
  add_cloth(world, variant.nodes, 1, 0.005, 0.2);
}

std::vector<Variant> sizes(double amount) {
  return {{7, amount}, {13, amount}, {21, amount}, {31, amount}, {41, amount}};
}

std::vector<StretchScene> stretch_scenes() {
  const double limit = 2;  // under weights
  return {
      {"falls on a ball", 1.5, 2, sizes(0),
       [](PhysicsWorld& world, const Variant& v) { fall_on_ball(world, v, 1); }},
      {"falls on a small ball",
       1.5,
       1,
       {{7, 0}, {11, 0}, {21, 0}},
       [](PhysicsWorld& world, const Variant& v) { fall_on_ball(world, v, 0.1); }},
      {"thrown at a ball", 1.5, 1, {{13, 10}, {13, 30}, {31, 10}, {31, 30}}, hit_ball},
      {"rollers", 1.5, 3, {{9, 2}, {15, 2}, {15, 10}}, roll},
      {"pulled over an edge", 1.5, 2, {{11, 0.3}, {21, 0.3}, {21, 1}}, pull_over_edge},
      {"spinning plate", 1.5, 2, {{13, 2}, {21, 6}}, spin},
      {"weight on a cloth",
       limit,
       2,
       {{13, 1}, {21, 1}, {13, 10}, {21, 10}, {13, 100}, {21, 100}, {13, 1000}, {21, 1000}},
       carry},
      {"rope round a pole", limit, 2, {{60, 1}, {120, 1}, {120, 10}, {120, 100}}, hold_by_pole},
  };
}

struct Result {
  double longest = 0, at_end = 0;  // link over its rest length
  double fastest = 0;              // node, m/s
  double ms = 0;                   // of a step
};

double longest_link(const PhysicsWorld& world) {
  double longest = 0;
  for (const auto& body : world.bodies()) {
    for (int i = 0; i < body->m_links.size(); ++i) {
      const btSoftBody::Link& link = body->m_links[i];
      const btScalar length = (link.m_n[0]->m_x - link.m_n[1]->m_x).length();
      longest = std::max(longest, static_cast<double>(length / link.m_rl));
    }
  }
  return longest;
}

Result run(const StretchScene& scene, const Variant& variant, double dt, Collisions collisions) {
  WorldOptions options;
  options.world = World::rigid;
  options.collisions = collisions;
  options.dt = dt;
  options.gravity = 9.81;
  options.margin = 0.005;
  const auto world = PhysicsWorld::make(options);
  scene.build(*world, variant);
  const int steps = static_cast<int>(std::lround(scene.seconds / dt));
  Result result;
  for (int i = 0; i < steps; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    world->step();
    result.ms += std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
                     .count() /
                 steps;
    result.at_end = longest_link(*world);
    result.longest = std::max(result.longest, result.at_end);
    for (const auto& body : world->bodies())
      for (int n = 0; n < body->m_nodes.size(); ++n)
        result.fastest =
            std::max(result.fastest, static_cast<double>(body->m_nodes[n].m_v.length()));
  }
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("How far contacts stretch links: Bullet alone against LazyCCD");
  std::string only;
  std::vector<int> rates = {30, 60, 120, 240};
  app.add_option("--scene", only, "only scenes whose names contain this text");
  app.add_option("--rates", rates, "steps a second");
  CLI11_PARSE(app, argc, argv);
  std::printf(
      "| scene | nodes | amount | steps a second | bound | beyond | Bullet longest | at the end | "
      "LazyCCD longest | at the end | Bullet m/s | LazyCCD m/s | Bullet ms | LazyCCD ms |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  int faults = 0, runs = 0;
  for (const StretchScene& scene : stretch_scenes()) {
    if (scene.name.find(only) == std::string::npos) continue;
    for (const Variant& variant : scene.variants) {
      for (const int rate : rates) {
        const Result alone = run(scene, variant, 1.0 / rate, Collisions::bullet),
                     ours = run(scene, variant, 1.0 / rate, Collisions::lazyccd);
        const bool is_bounded = rate >= 60,
                   is_fault = is_bounded && !(ours.longest <= std::max(scene.bound, alone.longest));
        ++runs;
        faults += is_fault;
        std::printf(
            "| %s | %d | %g | %d | %s | %s | %.2f | %.2f | %.2f | %.2f | %.3g | %.3g | %.3f | %.3f "
            "|\n",
            scene.name.c_str(), variant.nodes, variant.amount, rate,
            is_bounded ? std::to_string(scene.bound).substr(0, 3).c_str() : "",
            is_fault ? "beyond" : "", alone.longest, alone.at_end, ours.longest, ours.at_end,
            alone.fastest, ours.fastest, alone.ms, ours.ms);
        std::fflush(stdout);
      }
    }
  }
  std::printf("%d of %d runs beyond their bounds\n", faults, runs);
  return faults == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
