// The programs lazyccd_sleeper_costs and lazyccd_sleeper_costs_double: measure what a step costs in
// which one cloth swings beside a ball and all others sleep on plates of their own.
//
//   lazyccd_sleeper_costs [--sleepers N...] [--threads N] [--csv FILE]
//
// With LazyCCD and with Bullet alone; their steps run in turn. Medians, in milliseconds a step.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "bench/machine.h"
#include "scenes/meshes/cloth.h"
#include "scenes/meshes/shapes.h"
#include "scenes/worlds/physics_world.h"

namespace lazyccd::scenes {
namespace {

struct Request {
  std::vector<int> sleepers = {0, 9, 49, 199, 999};
  int threads = 1;
  std::string csv;
};

// A cloth that hangs by one side and swings beside a ball.
void add_swinging(PhysicsWorld& world) {
  std::mt19937 random(1);
  constexpr int nodes = 31;  // of a side
  world.add_static(make_sphere(0.3), at(0, 0.4, 0.6));
  Sheet sheet{nodes, nodes, 1, 1};
  sheet.height = 1;
  sheet.jitter = 0.002;
  auto cloth = make_sheet(world.info(), sheet, random);
  pin(*cloth, 0, nodes - 1);
  cloth->setActivationState(DISABLE_DEACTIVATION);
  world.add(std::move(cloth));
}

// Cloths in rows, each asleep on a plate.
void add_sleepers(PhysicsWorld& world, int count) {
  std::mt19937 random(2);
  constexpr double distance = 2;  // m
  const int columns = std::max(1, static_cast<int>(std::sqrt(count)));
  for (int i = 0; i < count; ++i) {
    const double x = distance * (2 + i % columns), z = distance * (i / columns);
    world.add_static(make_box(0.6, 0.1, 0.6), at(x, -0.1, z));
    Sheet sheet{15, 15, 1, 1};
    sheet.height = 2 * world.options().margin;
    sheet.jitter = 0.002;
    auto cloth = make_sheet(world.info(), sheet, random);
    cloth->translate(vector(x, 0, z));
    btSoftBody& sleeper = *cloth;
    world.add(std::move(cloth));
    sleeper.m_sleepingThreshold = btScalar(0.04);  // Bullet's default, m/s
    sleeper.forceActivationState(ISLAND_SLEEPING);
  }
}

std::unique_ptr<PhysicsWorld> make(World world, Collisions collisions, int sleepers, int threads) {
  WorldOptions options;
  options.world = world;
  options.collisions = collisions;
  options.gravity = 10;
  options.lazyccd.detector.threads = threads;
  auto made = PhysicsWorld::make(options);
  add_swinging(*made);
  add_sleepers(*made, sleepers);
  return made;
}

int count_awake(const PhysicsWorld& world) {
  return static_cast<int>(std::count_if(world.bodies().begin(), world.bodies().end(),
                                        [](const auto& body) { return body->isActive(); }));
}

double milliseconds_of_step(PhysicsWorld& world) {
  const auto begin = std::chrono::steady_clock::now();
  world.step();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
      .count();
}

void measure(const Request& request) {
  constexpr int warm_up = 48, measured = 240;  // steps
  std::ofstream csv;
  if (!request.csv.empty()) {
    csv.open(request.csv);
    csv << "world,sleepers,Bullet alone,with LazyCCD,LazyCCD's own part,awake with Bullet alone,"
           "awake with LazyCCD,machine\n";
  }
  std::printf(
      "| world | asleep | Bullet alone | with LazyCCD | LazyCCD's own part | times one alone | "
      "awake, "
      "Bullet alone | with LazyCCD |\n|---|---|---|---|---|---|---|---|\n");
  for (const World world : {World::rigid, World::deformable}) {
    const char* const name = world == World::rigid ? "rigid" : "deformable";
    double one_alone = 0;
    for (const int sleepers : request.sleepers) {
      const auto alone = make(world, Collisions::bullet, sleepers, request.threads);
      const auto with = make(world, Collisions::lazyccd, sleepers, request.threads);
      std::vector<double> bullet, lazyccd, own;
      for (int i = 0; i < warm_up + measured; ++i) {
        const double a = milliseconds_of_step(*alone), b = milliseconds_of_step(*with);
        if (i < warm_up) continue;
        const bullet::StepStats& s = *with->step_stats();
        bullet.push_back(a);
        lazyccd.push_back(b);
        own.push_back(s.ms_gather + s.ms_detect + s.ms_response + s.ms_write);
      }
      const double a = bench::median(bullet), b = bench::median(lazyccd), c = bench::median(own);
      if (one_alone == 0) one_alone = b;
      const int awake_alone = count_awake(*alone), awake = count_awake(*with);
      std::printf("| %s | %d | %.3f | %.3f | %.3f | %.2f | %d | %d |\n", name, sleepers, a, b, c,
                  b / one_alone, awake_alone, awake);
      std::fflush(stdout);
      if (csv.is_open())
        csv << name << ',' << sleepers << ',' << a << ',' << b << ',' << c << ',' << awake_alone
            << ',' << awake << ',' << bench::machine() << std::endl;
    }
  }
}

}  // namespace
}  // namespace lazyccd::scenes

int main(int argc, char** argv) try {
  CLI::App app("What a step costs in which one cloth moves and others sleep");
  lazyccd::scenes::Request request;
  app.add_option("--sleepers", request.sleepers, "numbers of cloths that sleep");
  app.add_option("--threads", request.threads, "threads of LazyCCD");
  app.add_option("--csv", request.csv, "write the measurements to this file");
  CLI11_PARSE(app, argc, argv);
  lazyccd::scenes::measure(request);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
