// What applications do to a soft body: how they set it up, and what they change while it runs.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <string>

#include "random/random.h"
#include "random/random_world.h"

namespace lazyccd::test {

struct Manner {
  double size;   // of the scene, metres
  double speed;  // m/s
  double step;   // s
  bool closed;   // the body's surface
};

// Masses, pinned nodes, stiffness, damping, friction, air, clusters, forces. Says in a word what is
// unusual. The body is to be added to the world after it, its forces after that.
std::string set_up(btSoftBody& body, const Manner& manner, RandomWorld& world, Dice& dice);
std::string add_forces(btSoftBody& body, const Manner& manner, RandomWorld& world, Dice& dice);

// One of the changes that put no node elsewhere. Says which.
std::string change(btSoftBody& body, const Manner& manner, const RandomWorld& world, Dice& dice);

}  // namespace lazyccd::test
