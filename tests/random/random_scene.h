// Random scenes: one of Bullet's worlds, with LazyCCD or without. Random soft and rigid bodies are
// thrown at each other, and between steps the scene changes as an application may change it. No
// bodies intersect at the start.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "lazyccd/bullet/options.h"
#include "lazyccd/bullet/report.h"
#include "random/penetration_check.h"
#include "random/random_options.h"
#include "scenes/worlds/physics_world.h"

namespace lazyccd::test {

/// Result of a whole scene.
struct SceneReport {
  std::string what;  ///< the scene in words
  int steps = 0, vertices = 0;
  /// Contacts on the straight motion between steps, summed over all steps. Decided exactly.
  std::int64_t crossings = 0;
  /// Edge-face intersections at the end of a step; the largest number. Decided exactly.
  std::int64_t intersections = 0;
  /// Crossings and intersections with driven rigid bodies; not in the two numbers above.
  std::int64_t overlaps = 0;
  int first_crossing = -1;  ///< step of the first of `crossings`; -1: none
  /// Something has prescribed motion, so bodies may be crushed between it and others.
  bool driven = false;
  bool finite = true;
  /// A body was left out, because it is lost. The run ends then: that body passes through anything.
  bool left_out = false;
  double kinetic_at_start = 0;               // J
  double fastest_at_start = 0, fastest = 0;  // m/s
  double slowest_step = 0;                   // s
  bullet::StepStats stats;
  std::string status;
};

/// State after one step, for a callback that looks closer.
struct SceneStep {
  const std::string& what;  ///< the scene in words, up to this step
  int number;
  double dt;               ///< wall time of the step, s
  std::int64_t crossings;  ///< of this step
  const bullet::StepStats& stats;
  const PenetrationCheck& penetration_check;
};

/// Builds the scene of this number and runs 30 to 89 steps. Ends early if a position is not finite
/// or a node exceeds 2000 m/s. The scene depends on the arguments alone.
SceneReport run_random_scene(std::uint32_t number, scenes::World world,
                             scenes::Collisions collisions = scenes::Collisions::lazyccd,
                             const bullet::SolverOptions& options = strict_options(),
                             const std::function<void(const SceneStep&)>& after_step = {});

}  // namespace lazyccd::test
