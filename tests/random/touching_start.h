// A soft body that starts on something, at a distance of zero or nearly so.
#pragma once

#include <cstdint>
#include <string>

#include "scenes/worlds/physics_world.h"

namespace lazyccd::test {

/// What a start came to after half a second.
struct StartReport {
  std::string what;       ///< the scene in words
  bool is_finite = true;  ///< all positions
  int fallen = 0;         ///< nodes below the surface that the body started on, beside its edges
  std::int64_t piercing = 0;  ///< edges that pass through faces
  double fastest = 0;         ///< largest speed of a node in any step, m/s
  double gained = 0;  ///< largest energy of motion and place in any step, less that at the start, J
  double scale = 0;   ///< energy of the scene: the weight of all bodies, lifted by their size, J
  double lift = 0;    ///< energy that it takes to come out of what it starts inside of, J
  std::string status;  ///< of LazyCCD
};

/// Runs a start: a random soft body on a random obstacle, at a random distance, place, rotation and
/// margin. The same number gives the same start, with Bullet alone too.
StartReport run_touching_start(std::uint32_t number, scenes::World world,
                               scenes::Collisions collisions);

/// What is wrong with a start, in words; empty if nothing is. `alone`: the same with Bullet alone.
std::string faults_of(const StartReport& start, const StartReport& alone);

}  // namespace lazyccd::test
