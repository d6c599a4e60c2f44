// Energy and momentum of the nodes that are not pinned.
#pragma once

#include <array>

#include "scenes/physics_world.h"

namespace lazyccd::scenes {

struct Mechanics {
  double kinetic_energy = 0;                   // J
  std::array<double, 3> momentum = {0, 0, 0};  // kg m/s
  double impulse_scale = 0;                    // kg m/s: the sum of the nodes' absolute momenta
};

Mechanics measure(const PhysicsWorld& world);

}  // namespace lazyccd::scenes
