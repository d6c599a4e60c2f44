// Random changes to soft bodies, as applications make them: at set-up and during the simulation.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <string>

#include "random/random_source.h"
#include "random/random_world.h"

namespace lazyccd::test {

/// Magnitudes of the changes.
struct ChangeLimits {
  double size;   ///< of the scene, metres
  double speed;  ///< largest speed, m/s
  double step;   ///< time step, s
  bool closed;   ///< the body has a closed surface
};

/// Sets masses, pinned nodes, stiffness, damping, friction, air drag and clusters. Call it before
/// the body is added to the world. Returns words for what is unusual, or an empty string.
std::string set_up(btSoftBody& body, const ChangeLimits& limits, RandomWorld& world,
                   RandomSource& random);
/// Adds the deformable world's forces. Call it after the body was added to the world. Returns the
/// kind of elasticity in a word, or an empty string.
std::string add_forces(btSoftBody& body, const ChangeLimits& limits, RandomWorld& world,
                       RandomSource& random);

/// Makes one random change that moves no node. Returns its name, or an empty string.
std::string change(btSoftBody& body, const ChangeLimits& limits, const RandomWorld& world,
                   RandomSource& random);

}  // namespace lazyccd::test
