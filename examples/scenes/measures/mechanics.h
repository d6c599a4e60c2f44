// Energy and momentum of a world.
#pragma once

#include <array>

#include "scenes/worlds/physics_world.h"

namespace lazyccd::scenes {

/// Sums over the nodes that are not pinned and the dynamic rigid bodies.
struct Mechanics {
  double kinetic_energy = 0;                           // J
  double potential_energy = 0;                         // J, of gravity; 0 at y = 0
  std::array<double, 3> momentum = {0, 0, 0};          // kg m/s
  std::array<double, 3> angular_momentum = {0, 0, 0};  // kg m^2/s, about the origin
  double impulse_scale = 0;                            // kg m/s: sum of mass times speed
  double rms_speed = 0, largest_speed = 0;             // m/s, of the nodes only

  double energy() const { return kinetic_energy + potential_energy; }
};

Mechanics measure(const PhysicsWorld& world);

}  // namespace lazyccd::scenes
