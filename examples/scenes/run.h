// Runs a scene to its end and counts everything that goes wrong.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "scenes/measures/intersections.h"
#include "scenes/measures/mechanics.h"
#include "scenes/scene.h"

namespace lazyccd::scenes {

/// Wall time of a step, ms, without the time of the counters. LazyCCD's parts are as in StepStats;
/// `bullet` is the rest of `total`.
struct StepTimes {
  double total = 0, bullet = 0, gather = 0, detect = 0, response = 0, write = 0;
};

/// What happened in a run.
struct RunReport {
  int steps = 0;
  double margin = 0;                                // m, of each body
  std::int64_t crossings_vf = 0, crossings_ee = 0;  // pass-throughs, over all steps
  std::size_t initial_intersections = 0;            // edge-face intersections at the start
  std::vector<Intersection> intersections;          // at the end
  std::int64_t listed_contacts = 0;  // in Bullet's own lists after each step, over all steps
  std::optional<int> wrong_side;  // nodes on the wrong side, at the end; empty: the scene has none
  std::vector<double> kinetic_energy;  // J, after each step
  std::vector<StepTimes> times;        // of each step
  double highest_energy = 0;  // J, kinetic plus potential, the maximum over start and steps
  Mechanics start, end;
  bool finite = true;         // all positions; false: the run stopped
  StepTimes mean, median;     // of each part by itself; the first step also builds persistent data
  bullet::StepStats lazyccd;  // summed over the steps; all zero with Bullet alone
  std::vector<bullet::StepStats> lazyccd_steps;  // of each step; empty with Bullet alone
  std::string status;
};

/// Runs the scene. `after_step`, if given, is called with the number of finished steps: first 0,
/// then after each step.
RunReport run(Scene& scene, const std::function<void(int step)>& after_step = {});

}  // namespace lazyccd::scenes
