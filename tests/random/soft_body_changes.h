// What applications do to a soft body: how they set it up, and what they change while it runs.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <string>

#include "random/random_source.h"
#include "random/random_world.h"

namespace lazyccd::test {

struct ChangeLimits {
  double size;   // of the scene, metres
  double speed;  // m/s
  double step;   // s
  bool closed;   // the body's surface
};

// Masses, pinned nodes, stiffness, damping, friction, air, clusters, forces. Says in a word what is
// unusual. The body is to be added to the world after it, its forces after that.
std::string set_up(btSoftBody& body, const ChangeLimits& manner, RandomWorld& world, RandomSource& random);
std::string add_forces(btSoftBody& body, const ChangeLimits& manner, RandomWorld& world, RandomSource& random);

// One of the changes that put no node elsewhere. Says which.
std::string change(btSoftBody& body, const ChangeLimits& manner, const RandomWorld& world, RandomSource& random);

}  // namespace lazyccd::test
