// Measures how far soft bodies slide, are fed and are held, in the rigid world, with Bullet alone
// and with LazyCCD.
//
//   lazyccd_friction                  all scenes; a table
//   lazyccd_friction --scene rollers  one of them
//
// Exit code 1 if a result is out of its bounds:
// - a soft box on a plate slides as far as with Bullet alone, within a tenth;
// - rollers feed a cloth by at least half of what their surfaces turn; it may fall on, behind them;
// - with Coulomb's friction, a rope round a pole slips where the forces at its ends differ by the
//   factor of the capstan's formula, exp(coefficient x angle), within a fifth.
#include <BulletCollision/CollisionShapes/btCylinderShape.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include "scenes/meshes/cloth.h"
#include "scenes/meshes/shapes.h"
#include "scenes/meshes/solid.h"
#include "scenes/worlds/physics_world.h"

using namespace lazyccd::scenes;

namespace {

constexpr double pi = 3.14159265358979;

struct FrictionScene {
  std::string name;
  // What is measured: metres, or a ratio of forces. `Collisions`: with LazyCCD or without.
  std::function<double(Collisions)> measure;
  // The least and the largest right result, from that of Bullet alone.
  std::function<std::array<double, 2>(double)> bounds;
};

std::unique_ptr<PhysicsWorld> make_world(Collisions collisions, double dt, double gravity,
                                         bool coulomb = false) {
  WorldOptions options;
  options.world = World::rigid;
  options.collisions = collisions;
  options.dt = dt;
  options.gravity = gravity;
  options.margin = 0.005;
  options.lazyccd.coulomb_friction = coulomb;
  return PhysicsWorld::make(options);
}

btSoftBody& add(PhysicsWorld& world, std::unique_ptr<btSoftBody> made, int iterations,
                double friction) {
  btSoftBody& body = *made;
  world.add(std::move(made));
  body.m_materials[0]->m_kLST = 1;
  body.m_cfg.piterations = iterations;
  body.m_cfg.kDF = static_cast<btScalar>(friction);
  body.setActivationState(DISABLE_DEACTIVATION);
  return body;
}

double mean(const btSoftBody& body, int axis) {
  double sum = 0;
  for (int i = 0; i < body.m_nodes.size(); ++i)
    sum += static_cast<double>(body.m_nodes[i].m_x[axis]);
  return sum / body.m_nodes.size();
}

// A soft box on a plate, at 3 m/s. Returns how far it slides in 2 s, metres.
double slide(Collisions collisions, double dt, double coefficient, int iterations) {
  const auto world = make_world(collisions, dt, 9.81);
  world->add_static(make_box(40, 1, 4), at(10, -0.5, 0));
  world->rigid_bodies().back().body->setFriction(1);
  btSoftBody& box = add(*world,
                        make_solid(world->info(), 2, 1,
                                   [](double u, double v, double w) {
                                     return vector(0.4 * u, 0.4 * v + 0.01, 0.4 * w);
                                   }),
                        iterations, coefficient);
  box.setVelocity(vector(3, 0, 0));
  const double start = mean(box, 0);
  while (world->time() < 2) world->step();
  return mean(box, 0) - start;
}

// A cloth between two rollers that close in on it and then turn. Returns how far its middle is fed
// in 2 s, over what the surfaces of the rollers turn.
double feed(Collisions collisions, double dt, double rate) {
  constexpr double radius = 0.1, gap = 0.02, open = 0.05, closing = 1, turning = 2;
  const auto world = make_world(collisions, dt, 9.81);
  btSoftBody& cloth =
      add(*world,
          make_cloth(world->info(), 15, 31, 0.1,
                     [](double u, double v) { return vector(0.4 * (u - 0.5), 0, v - 0.95); }),
          4, 0.2);
  for (const double side : {1.0, -1.0}) {
    world->add_moving(
        std::make_unique<btCylinderShapeX>(vector(0.3, radius, radius)), [=](double time) {
          const double away = open + (gap / 2 - open) * std::min(1.0, time / closing);
          btTransform pose = at(0, side * (radius + away), 0);
          const double turned = rate * std::max(0.0, time - closing);
          pose.setRotation(btQuaternion(vector(1, 0, 0), static_cast<btScalar>(-side * turned)));
          return pose;
        });
  }
  world->add_static(make_box(0.6, 0.04, 1.2), at(0, -0.035, -0.63));
  world->rigid_bodies().back().body->setFriction(0);
  while (world->time() < closing) world->step();
  const double start = mean(cloth, 2);
  while (world->time() < closing + turning) world->step();
  return std::abs(mean(cloth, 2) - start) / (rate * radius * turning);
}

// A rope round a pole, without gravity. A force holds one end, `ratio` times that force pulls at
// the other. Returns how far the held end moves in the last 2 s of 6, metres.
double slip(Collisions collisions, double dt, double coefficient, double turns, double ratio) {
  constexpr double radius = 0.1, around = radius + 0.0105, hold = 0.005;  // m, N
  constexpr int nodes = 120;
  const auto world = make_world(collisions, dt, 0, true);
  world->add_static(std::make_unique<btCylinderShapeZ>(vector(radius, radius, 1)), at(0, 0, 0));
  world->rigid_bodies().back().body->setFriction(1);
  btSoftBody& rope =
      add(*world, make_wound_rope(world->info(), nodes, 0.1, around, turns, 0.05, 0.3), 20,
          coefficient);
  const btVector3 along =
      vector(-std::sin(2 * pi * turns), std::cos(2 * pi * turns), 0);  // at the held end
  world->drive([&](double time) {
    const double load = hold * (1 + std::min(1.0, time) * (ratio - 1));
    rope.addForce(vector(0, -load, 0), 0);
    rope.addForce(btScalar(hold) * along, nodes - 1);
  });
  const auto place = [&] { return static_cast<double>(rope.m_nodes[nodes - 1].m_x.dot(along)); };
  while (world->time() < 4) world->step();
  const double before = place();
  while (world->time() < 6) world->step();
  return before - place();
}

// Returns the least ratio of forces, over that of the capstan's formula, at which the rope slips by
// a centimetre in 2 s; 2 if there is none.
double slipping_ratio(Collisions collisions, double dt, double coefficient, double turns) {
  const double expected = std::exp(coefficient * 2 * pi * turns);
  for (double part = 0.5; part < 2; part += 0.1)
    if (slip(collisions, dt, coefficient, turns, part * expected) > 0.01) return part;
  return 2;
}

std::vector<FrictionScene> friction_scenes(double dt) {
  std::vector<FrictionScene> scenes;
  const auto name = [](const char* text, double a, double b) {
    char buffer[100];
    std::snprintf(buffer, sizeof buffer, text, a, b);
    return std::string(buffer);
  };
  for (const double coefficient : {0.02, 0.05, 0.1, 0.2, 0.3})
    for (const int iterations : {1, 4, 10})
      scenes.push_back(
          {name("soft box slides, coefficient %g, %g iterations", coefficient, iterations),
           [=](Collisions c) { return slide(c, dt, coefficient, iterations); },
           [](double alone) {
             return std::array<double, 2>{0.9 * alone, 1.1 * alone};
           }});
  for (const double rate : {1.0, 2.0, 5.0})
    scenes.push_back({name("rollers, %g rad/s", rate, 0),
                      [=](Collisions c) { return feed(c, dt, rate); },
                      [](double) {
                        return std::array<double, 2>{0.5, 2};
                      }});
  for (const double turns : {1.0, 3.0})
    for (const double coefficient : {0.05, 0.1, 0.2})
      scenes.push_back({name("rope round a pole, %g turns, coefficient %g", turns, coefficient),
                        [=](Collisions c) { return slipping_ratio(c, dt, coefficient, turns); },
                        [=](double) {
                          return std::array<double, 2>{0.8, 1.2};
                        }});
  return scenes;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("How far soft bodies slide, are fed and are held: Bullet alone against LazyCCD");
  std::string only;
  int rate = 60;
  app.add_option("--scene", only, "only scenes whose names contain this text");
  app.add_option("--rate", rate, "steps a second");
  CLI11_PARSE(app, argc, argv);
  std::printf("| scene | Bullet | LazyCCD | right |\n|---|---|---|---|\n");
  int faults = 0, runs = 0;
  for (const FrictionScene& scene : friction_scenes(1.0 / rate)) {
    if (scene.name.find(only) == std::string::npos) continue;
    const double alone = scene.measure(Collisions::bullet),
                 ours = scene.measure(Collisions::lazyccd);
    const auto [least, most] = scene.bounds(alone);
    const bool is_right = least <= ours && ours <= most;
    ++runs;
    faults += !is_right;
    std::printf("| %s | %.3f | %s%.3f%s | %.3f to %.3f |\n", scene.name.c_str(), alone,
                is_right ? "" : "**", ours, is_right ? "" : "**", least, most);
    std::fflush(stdout);
  }
  std::printf("%d of %d runs out of their bounds\n", faults, runs);
  return faults == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
