// A world of Bullet with LazyCCD that nobody thought of: random soft and rigid bodies, thrown at
// each other, with everything that an application may do to them. Its start intersects nothing.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "lazyccd/bullet/options.h"
#include "lazyccd/bullet/report.h"
#include "random/penetration_check.h"
#include "scenes/worlds/physics_world.h"

namespace lazyccd::test {

struct SceneReport {
  std::string what;  // the scene in words
  int steps = 0, vertices = 0;
  std::int64_t crossings = 0;  // of the surfaces' straight motion between steps, exactly
  std::int64_t intersections = 0;  // most at the end of a step, exactly
  std::int64_t overlaps = 0;   // both, with driven rigid bodies
  int first_crossing = -1;     // step
  bool driven = false;         // kinematic bodies may crush what is between them
  bool finite = true;
  double kinetic_at_start = 0;               // J
  double fastest_at_start = 0, fastest = 0;  // m/s
  double slowest_step = 0;                   // s
  bullet::StepStats stats;
  std::string status;
};

// What is to be seen after each step, for those who want to look closer.
struct SceneStep {
  const std::string& what;  // the scene until now
  int number;
  double dt;  // that it took
  std::int64_t crossings;
  const bullet::StepStats& stats;
  const PenetrationCheck& penetration_check;
};

SceneReport run_random_scene(std::uint32_t number, scenes::World world,
                             scenes::Collisions collisions = scenes::Collisions::lazyccd,
                             const bullet::SolverOptions& options = {},
                             const std::function<void(const SceneStep&)>& after_step = {});

}  // namespace lazyccd::test
