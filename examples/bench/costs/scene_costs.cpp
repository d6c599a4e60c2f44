// The programs lazyccd_scene_costs and lazyccd_scene_costs_double: measure the time of a step in
// the scenes of cost_scenes.h, with Bullet alone and with LazyCCD.
//
//   lazyccd_scene_costs [--rounds N] [--only TEXT] [--world NAME] [--csv FILE] [--cpu-time]
//
// Each step is timed by itself, over one second from the start. Its time is the median over the
// rounds, in which Bullet alone and LazyCCD take turns. The table has the median over the steps,
// the 99th percentile, and the largest depth of a node in a rigid body, sampled twenty times a
// second. The CSV file has mean, longest and first step too. Run it on an idle machine.
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <LinearMath/btAabbUtil2.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <numeric>
#include <string>
#include <vector>

#include "bench/costs/cost_scenes.h"
#include "bench/machine.h"

namespace lazyccd::scenes {
namespace {

constexpr const char* precision = sizeof(btScalar) == sizeof(float) ? "float" : "double";

// Milliseconds of the timed steps.
struct Cost {
  double mean = 0, median = 0, percentile_99 = 0, longest = 0, first = 0;
};

Cost cost_of(std::vector<double> steps) {
  Cost cost;
  if (steps.empty()) return cost;
  cost.first = steps.front();
  std::sort(steps.begin(), steps.end());
  cost.mean = std::accumulate(steps.begin(), steps.end(), 0.0) / static_cast<double>(steps.size());
  cost.median = bench::median(steps);
  cost.percentile_99 = steps[(steps.size() - 1) * 99 / 100];
  cost.longest = steps.back();
  return cost;
}

struct Run {
  std::vector<double> steps;  // milliseconds
  double deepest = 0;         // m: largest depth of a node in a rigid body, over all samples
};

// Returns how deep a point is inside a convex hull that contains the origin, metres; 0: outside.
double depth_in(const Triangles& hull, const btVector3& p) {
  const std::vector<btVector3>& x = hull.vertices;
  btScalar min_depth = hull.faces.empty() ? 0 : BT_LARGE_FLOAT;
  for (const Face& face : hull.faces) {
    const btVector3 across = (x[face[1]] - x[face[0]]).cross(x[face[2]] - x[face[0]]);
    if (across.fuzzyZero()) continue;
    const btScalar outwards = across.dot(x[face[0]]) > 0 ? 1 : -1;
    min_depth = btMin(min_depth, outwards * across.dot(x[face[0]] - p) / across.length());
    if (min_depth < 0) return 0;
  }
  return static_cast<double>(min_depth);
}

// Returns how deep a point is inside a convex body, a character or a plane, metres.
double depth_in(const RigidBody& rigid, const btVector3& point) {
  const btVector3 p = rigid.body->getWorldTransform().invXform(point);
  if (const auto* plane = dynamic_cast<const btStaticPlaneShape*>(rigid.shape.get()))
    return static_cast<double>(plane->getPlaneConstant() - plane->getPlaneNormal().dot(p));
  double deepest = rigid.shape->isConvex() ? depth_in(rigid.surface, p) : 0;
  if (const auto* character = dynamic_cast<const Character*>(rigid.shape.get())) {
    for (const Character::Part& part : character->parts())
      deepest = std::max(deepest, depth_in(part.surface, part.pose.invXform(p)));
  }
  return deepest;
}

double deepest_node(const PhysicsWorld& world) {
  double deepest = 0;
  for (const RigidBody& rigid : world.rigid_bodies()) {
    btVector3 lower, upper;
    rigid.shape->getAabb(rigid.body->getWorldTransform(), lower, upper);
    for (const auto& body : world.bodies()) {
      for (int i = 0; i < body->m_nodes.size(); ++i) {
        const btVector3& x = body->m_nodes[i].m_x;
        if (TestPointAgainstAabb2(lower, upper, x)) deepest = std::max(deepest, depth_in(rigid, x));
      }
    }
  }
  return deepest;
}

// Returns the time in milliseconds: the processor time of this process, or wall time.
double now(bool processor_time) {
  if (processor_time) return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
  const auto time = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double, std::milli>(time).count();
}

Run run(const CostScene& scene, WorldOptions options, bool processor_time) {
  constexpr int samples_per_second = 20;
  options.gravity = scene.gravity;
  if (processor_time) options.lazyccd.detector.threads = 1;
  options.margin = scene.untuned ? CONVEX_DISTANCE_MARGIN : scene.margin;
  const auto world = PhysicsWorld::make(options);
  scene.build(*world);
  constexpr btScalar soft_margin(0.25);  // btSoftBody's own
  for (const auto& body : world->bodies())
    if (scene.untuned) body->getCollisionShape()->setMargin(soft_margin);
  const int steps = static_cast<int>(std::lround(scene.seconds / options.dt));
  const int steps_per_sample = static_cast<int>(std::lround(1 / (samples_per_second * options.dt)));
  for (int i = 0; i < scene.warm_up_steps; ++i) world->step();
  Run run;
  for (int i = 0; i < steps; ++i) {
    const double begin = now(processor_time);
    world->step();
    run.steps.push_back(now(processor_time) - begin);
    if ((i + 1) % steps_per_sample == 0 || i + 1 == steps)
      run.deepest = std::max(run.deepest, deepest_node(*world));
  }
  return run;
}

struct Request {
  int rounds = 5;
  std::string only, world, csv;
  bool processor_time = false;
};

// One scene with Bullet alone or with LazyCCD, over all rounds.
struct Series {
  std::vector<std::vector<double>> rounds;  // by step
  double deepest = 0;

  void add(Run run) {
    rounds.resize(run.steps.size());
    for (std::size_t i = 0; i < rounds.size(); ++i) rounds[i].push_back(run.steps[i]);
    deepest = run.deepest;
  }
  Cost cost() const {
    std::vector<double> steps;
    for (const std::vector<double>& step : rounds) steps.push_back(bench::median(step));
    return cost_of(std::move(steps));
  }
};

struct Comparison {
  Series alone, ours;
};

Comparison compare(const CostScene& scene, WorldOptions options, const Request& request) {
  Comparison result;
  for (int i = 0; i < request.rounds; ++i) {
    options.collisions = Collisions::bullet;
    result.alone.add(run(scene, options, request.processor_time));
    options.collisions = Collisions::lazyccd;
    result.ours.add(run(scene, options, request.processor_time));
  }
  return result;
}

void write(std::ostream& csv, const std::string& scene, const char* world, int rate,
           const Comparison& c) {
  const Cost alone = c.alone.cost(), ours = c.ours.cost();
  csv << '"' << scene << "\"," << world << ',' << precision << ',' << rate;
  for (const Cost& cost : {alone, ours})
    csv << ',' << cost.mean << ',' << cost.median << ',' << cost.percentile_99 << ','
        << cost.longest << ',' << cost.first;
  csv << ',' << 1e3 * c.alone.deepest << ',' << 1e3 * c.ours.deepest << ',' << bench::machine()
      << std::endl;
}

void print_table(const Request& request) {
  std::ofstream csv;
  if (!request.csv.empty()) {
    csv.open(request.csv);
    csv << "scene,world,precision,steps a second";
    for (const char* name : {"Bullet", "LazyCCD"})
      for (const char* figure : {"mean", "median", "99th percentile", "longest", "first"})
        csv << ',' << name << ' ' << figure << " ms";
    csv << ",Bullet sunk in mm,LazyCCD sunk in mm,machine\n";
  }
  std::printf(
      "| scene, %s | world | 1/60 s: Bullet | LazyCCD | ratio | 99 %% | depth, mm | 1/240 s: "
      "Bullet | LazyCCD | ratio | 99 %% | depth, mm |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|\n",
      precision);
  for (const CostScene& scene : cost_scenes()) {
    if (scene.name.find(request.only) == std::string::npos) continue;
    if (scene.only_by_name && scene.name != request.only) continue;
    if (scene.untuned && request.only.empty()) continue;  // in some of them Bullet alone crashes
    for (const World world : {World::rigid, World::deformable}) {
      const char* const name = world == World::rigid ? "rigid" : "deformable";
      if (!request.world.empty() && request.world != name) continue;
      if (world == World::deformable && scene.rigid_only) continue;
      std::printf("| %s | %s |", scene.name.c_str(), name);
      for (const int rate : {60, 240}) {
        WorldOptions options;
        options.world = world;
        options.dt = 1.0 / rate;
        const Comparison c = compare(scene, options, request);
        const Cost alone = c.alone.cost(), ours = c.ours.cost();
        std::printf(" %.3f | %.3f | %.2f | %.3f / %.3f | %.1f / %.1f |", alone.median, ours.median,
                    ours.median / alone.median, alone.percentile_99, ours.percentile_99,
                    1e3 * c.alone.deepest, 1e3 * c.ours.deepest);
        if (csv.is_open()) write(csv, scene.name, name, rate, c);
      }
      std::printf("\n");
      std::fflush(stdout);
    }
  }
}

}  // namespace
}  // namespace lazyccd::scenes

int main(int argc, char** argv) {
  CLI::App app("The time of a step in common scenes: Bullet alone against LazyCCD");
  lazyccd::scenes::Request request;
  app.add_option("--rounds", request.rounds,
                 "number of runs of each scene; the median is reported");
  app.add_option("--only", request.only, "only scenes whose names contain this text");
  app.add_option("--world", request.world, "only this world: rigid or deformable");
  app.add_option("--csv", request.csv, "write all measurements to this file");
  app.add_flag("--cpu-time", request.processor_time,
               "measure processor time with one thread, for a machine that is not idle");
  CLI11_PARSE(app, argc, argv);
  lazyccd::scenes::print_table(request);
  return 0;
}
