// The programs lazyccd_phase_costs and lazyccd_phase_costs_double: measure whether the cost of a
// step follows what happens in the scene.
//
//   lazyccd_phase_costs rest [--scene NAME]... [--seconds S] [--threads N] [--csv FILE]
//                            [--world NAME] [--without-bullet]
//   lazyccd_phase_costs islands [--rounds N] [--threads N]
//   lazyccd_phase_costs spawn [--rounds N] [--threads N]
//
// rest: cost over time of scenes whose bodies come to rest but never sleep. islands: the cost of
// two groups of bodies that never meet, one resting and one in an impact, against each alone.
// spawn: a step before which the application adds a body, against other steps of the scene. Times
// are milliseconds a step. Run it on an idle machine.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "bench/machine.h"
#include "scenes/meshes/cloth.h"
#include "scenes/meshes/shapes.h"
#include "scenes/scene.h"

namespace lazyccd::scenes {
namespace {

// Mean wall time of a step, and its parts.
struct PhaseCost {
  double total = 0, bullet = 0, gather = 0, detect = 0, response = 0, write = 0;
  double detections = 0;

  double own() const { return total - bullet; }
};

const char* name_of(World world) { return world == World::rigid ? "rigid" : "deformable"; }

PhaseCost run_steps(PhysicsWorld& world, int steps) {
  PhaseCost cost;
  for (int i = 0; i < steps; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    world.step();
    const std::chrono::duration<double, std::milli> wall = std::chrono::steady_clock::now() - begin;
    cost.total += wall.count() / steps;
    if (const bullet::StepStats* s = world.step_stats()) {
      cost.gather += s->ms_gather / steps;
      cost.detect += s->ms_detect / steps;
      cost.response += s->ms_response / steps;
      cost.write += s->ms_write / steps;
      cost.detections += static_cast<double>(s->detections) / steps;
    }
  }
  cost.bullet = cost.total - cost.gather - cost.detect - cost.response - cost.write;
  return cost;
}

void keep_awake(PhysicsWorld& world) {
  for (const auto& body : world.bodies()) body->setActivationState(DISABLE_DEACTIVATION);
  for (const RigidBody& body : world.rigid_bodies())
    if (!body.body->isStaticOrKinematicObject())
      body.body->setActivationState(DISABLE_DEACTIVATION);
}

struct RestRequest {
  std::vector<std::string> scenes = {"twenty-cloths", "drop", "fold"};
  double seconds = 8;
  int threads = 1;
  std::string csv, world;
  bool without_bullet = false;
};

void measure_rest(const RestRequest& request) {
  constexpr double window = 0.1;  // s
  std::ofstream csv;
  if (!request.csv.empty()) {
    csv.open(request.csv);
    csv << "scene,world,s,Bullet alone,with LazyCCD,Bullet's part,gather,detect,response,write,"
           "detections,machine\n";
  }
  std::printf(
      "| scene | world | Bullet alone: most | at rest | with LazyCCD: most | at rest | ratio "
      "| Bullet's part at rest | gather | detect | response | write |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const std::string& name : request.scenes) {
    const SceneInfo* const info = find_scene(name);
    if (!info) throw CLI::ValidationError("no scene has the name " + name);
    for (const World world : {World::rigid, World::deformable}) {
      if (!request.world.empty() && request.world != name_of(world)) continue;
      Parameters parameters;
      parameters.world = world;
      parameters.lazyccd.detector.threads = request.threads;
      Scene ours = set_up(*info, parameters);
      parameters.collisions = Collisions::bullet;
      Scene alone = set_up(*info, parameters);
      keep_awake(*ours.world);
      keep_awake(*alone.world);
      const int steps = static_cast<int>(std::lround(window / ours.world->options().dt));
      double most = 0, most_alone = 0;
      PhaseCost rest, rest_alone;
      for (double time = window; time < request.seconds + 0.5 * window; time += window) {
        if (!request.without_bullet) rest_alone = run_steps(*alone.world, steps);
        rest = run_steps(*ours.world, steps);
        most_alone = std::max(most_alone, rest_alone.total);
        most = std::max(most, rest.total);
        if (csv.is_open())
          csv << name << ',' << name_of(world) << ',' << time << ',' << rest_alone.total << ','
              << rest.total << ',' << rest.bullet << ',' << rest.gather << ',' << rest.detect << ','
              << rest.response << ',' << rest.write << ',' << rest.detections << ','
              << bench::machine() << std::endl;
      }
      std::printf(
          "| %s | %s | %.2f | %.2f | %.2f | %.2f | %.2f | %.3f | %.3f | %.3f | %.3f | %.3f |\n",
          name.c_str(), name_of(world), most_alone, rest_alone.total, most, rest.total,
          rest.total / most, rest.bullet, rest.gather, rest.detect, rest.response, rest.write);
      std::fflush(stdout);
    }
  }
}

constexpr double fall_time = 1.5;      // s
constexpr double impact_length = 0.3;  // s
constexpr double ball_radius = 0.3;    // m

// Cloths that lie on each other on a box.
void add_resting(PhysicsWorld& world) {
  std::mt19937 random(1);
  world.add_static(make_box(0.6, 0.4, 0.6), at(0, -0.2, 0));
  for (int i = 0; i < 8; ++i) {
    Sheet sheet{15, 15, 1, 1};
    sheet.height = 0.02 * (i + 1);
    sheet.angle = 0.1 * i;
    sheet.jitter = 0.002;
    world.add(make_sheet(world.info(), sheet, random));
  }
  keep_awake(world);
}

// Two cloths with self-collision that fall on a ball for about fall_time.
void add_falling(PhysicsWorld& world) {
  std::mt19937 random(2);
  constexpr double aside = 20;  // m
  const double height = 0.5 * world.options().gravity * fall_time * fall_time;
  world.add_static(make_box(1.6, 0.1, 1.6), at(aside, -0.05, 0));
  world.add_static(make_sphere(ball_radius), at(aside, ball_radius, 0));
  for (int i = 0; i < 2; ++i) {
    Sheet sheet{25, 25, 1.2, 1.2};
    sheet.height = height + 2 * ball_radius + 0.1 * i;
    sheet.angle = 0.2 + 0.6 * i;
    sheet.jitter = 0.002;
    auto cloth = make_sheet(world.info(), sheet, random);
    cloth->translate(vector(aside, 0, 0));
    cloth->setSelfCollision(true);
    world.add(std::move(cloth));
  }
}

bool has_landed(const PhysicsWorld& world) {
  const btSoftBody& last = *world.bodies().back();
  return std::any_of(&last.m_nodes[0], &last.m_nodes[0] + last.m_nodes.size(),
                     [](const btSoftBody::Node& node) {
                       return static_cast<double>(node.m_x.y()) < 2 * ball_radius + 0.15;
                     });
}

struct Repetitions {
  int rounds = 3;
  int threads = 1;
};

void measure_islands(const Repetitions& request) {
  std::printf(
      "| world | | resting | in an impact | both | both / sum |\n|---|---|---|---|---|---|\n");
  for (const World world : {World::rigid, World::deformable}) {
    std::vector<PhaseCost> resting, violent, both;
    for (int round = 0; round < request.rounds; ++round) {
      for (auto* const costs : {&resting, &violent, &both}) {
        WorldOptions options;
        options.world = world;
        options.gravity = 10;
        options.lazyccd.detector.threads = request.threads;
        const auto made = PhysicsWorld::make(options);
        if (costs != &violent) add_resting(*made);
        if (costs != &resting) add_falling(*made);
        int steps = static_cast<int>(std::lround(fall_time / options.dt));
        run_steps(*made, steps);
        for (; costs != &resting && !has_landed(*made); ++steps) run_steps(*made, 1);
        costs->push_back(
            run_steps(*made, static_cast<int>(std::lround(impact_length / options.dt))));
      }
    }
    const auto print = [&](const char* name, double PhaseCost::*part) {
      const auto median = [part](const std::vector<PhaseCost>& costs) {
        std::vector<double> values;
        for (const PhaseCost& cost : costs) values.push_back(cost.*part);
        return bench::median(std::move(values));
      };
      const double a = median(resting), b = median(violent), c = median(both);
      std::printf("| %s | %s | %.3f | %.3f | %.3f | %.2f |\n", name_of(world), name, a, b, c,
                  c / (a + b));
    };
    print("whole step", &PhaseCost::total);
    print("Bullet's part", &PhaseCost::bullet);
    print("detection", &PhaseCost::detect);
    print("response", &PhaseCost::response);
    print("detections", &PhaseCost::detections);
  }
}

// A cloth of 1 800 faces beside the others.
void add_beside(PhysicsWorld& world, std::mt19937& random) {
  constexpr std::size_t row = 10;
  constexpr double distance = 1.2;  // m
  const std::size_t i = world.bodies().size();
  auto cloth = make_sheet(world.info(), Sheet{30, 30, 1, 1}, random);
  cloth->translate(
      vector(distance * static_cast<double>(i % row), 0, distance * static_cast<double>(i / row)));
  world.add(std::move(cloth));
  keep_awake(world);
}

void measure_spawn(const Repetitions& request) {
  std::printf(
      "| world | bodies | Bullet alone: a step | with a new body | with LazyCCD: a step | with a "
      "new body |\n|---|---|---|---|---|---|\n");
  for (const World kind : {World::rigid, World::deformable}) {
    for (const int bodies : {4, 20, 100}) {
      std::printf("| %s | %d |", name_of(kind), bodies);
      for (const Collisions collisions : {Collisions::bullet, Collisions::lazyccd}) {
        WorldOptions options;
        options.world = kind;
        options.collisions = collisions;
        options.gravity = 0;
        options.lazyccd.detector.threads = request.threads;
        const auto world = PhysicsWorld::make(options);
        std::mt19937 random(3);
        for (int i = 0; i < bodies; ++i) add_beside(*world, random);
        run_steps(*world, 4);
        std::vector<double> ordinary, with_new;
        for (int round = 0; round < request.rounds; ++round) {
          ordinary.push_back(run_steps(*world, 4).total);
          add_beside(*world, random);
          with_new.push_back(run_steps(*world, 1).total);
        }
        std::printf(" %.2f | %.2f |", bench::median(ordinary), bench::median(with_new));
      }
      std::printf("\n");
      std::fflush(stdout);
    }
  }
}

}  // namespace
}  // namespace lazyccd::scenes

int main(int argc, char** argv) try {
  CLI::App app("Whether the cost of a step follows what happens in the scene");
  app.require_subcommand(1);
  lazyccd::scenes::RestRequest rest;
  CLI::App* const rest_command =
      app.add_subcommand("rest", "cost over time as things come to rest");
  rest_command->add_option("--scene", rest.scenes, "scenes of the library");
  rest_command->add_option("--seconds", rest.seconds, "length of a run, seconds");
  rest_command->add_option("--threads", rest.threads, "threads of LazyCCD");
  rest_command->add_option("--world", rest.world, "only this world: rigid or deformable");
  rest_command->add_flag("--without-bullet", rest.without_bullet, "do not run Bullet alone");
  rest_command->add_option("--csv", rest.csv, "write all measurements to this file");
  lazyccd::scenes::Repetitions islands, spawn;
  spawn.rounds = 9;
  CLI::App* const island_command =
      app.add_subcommand("islands", "cost of two groups of bodies that never meet");
  island_command->add_option("--rounds", islands.rounds, "number of runs; medians are reported");
  island_command->add_option("--threads", islands.threads, "threads of LazyCCD");
  CLI::App* const spawn_command =
      app.add_subcommand("spawn", "cost of a step before which a body is added");
  spawn_command->add_option("--rounds", spawn.rounds,
                            "bodies that are added; medians are reported");
  spawn_command->add_option("--threads", spawn.threads, "threads of LazyCCD");
  CLI11_PARSE(app, argc, argv);
  if (*rest_command) lazyccd::scenes::measure_rest(rest);
  if (*island_command) lazyccd::scenes::measure_islands(islands);
  if (*spawn_command) lazyccd::scenes::measure_spawn(spawn);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
