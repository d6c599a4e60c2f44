// Steps a scene with all counters.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "scenes/measures/mechanics.h"
#include "scenes/measures/intersections.h"
#include "scenes/scene.h"

namespace lazyccd::scenes {

// Wall time of a step, ms: of LazyCCD's parts as in StepStats, and of the rest. Without the
// counters.
struct StepTimes {
  double total = 0, bullet = 0, gather = 0, detect = 0, response = 0, write = 0;
};

struct RunReport {
  int steps = 0;
  double margin = 0;                                // m, of each body
  std::int64_t crossings_vf = 0, crossings_ee = 0;  // over all steps
  std::size_t piercings_at_start = 0;
  std::vector<Intersection> intersections;     // at the end
  std::int64_t listed_contacts = 0;    // in Bullet's own lists after each step, over all steps
  std::optional<int> wrong_side;       // nodes, at the end
  std::vector<double> kinetic_energy;  // J, after each step
  double highest_energy = 0;           // J, kinetic and potential, at the start or after any step
  Mechanics start, end;
  bool finite = true;         // all positions at the end
  StepTimes mean, median;     // each part by itself; the first step also builds what lasts
  bullet::StepStats lazyccd;  // summed; all zero with Bullet alone
  std::string status;
};

// `after_step`, where given, is called with the number of steps done so far, 0 before the first.
RunReport run(Scene& scene, const std::function<void(int step)>& after_step = {});

}  // namespace lazyccd::scenes
