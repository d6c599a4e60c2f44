// Soft bodies that several behaviour scenes have.
#pragma once

#include "scenes/behaviour/application.h"

namespace lazyccd::scenes::behaviour {

/// A square cloth, level, with small random offsets of its nodes.
struct Cloth {
  int nodes;             // along a side
  double width;          // m
  double height = 0;     // m
  double mass = 1;       // kg
  double stiffness = 2;  // N/m, of a spring in the deformable world
  double angle = 0.2;    // rad, about the vertical axis
};
/// The same, not yet in the world.
std::unique_ptr<btSoftBody> make(Application& application, const Cloth& cloth);
btSoftBody* add(Application& application, const Cloth& cloth);

/// Adds a soft ball. In the rigid world it is a closed surface with inner pressure, in the
/// deformable world an elastic solid, less round.
struct Ball {
  btVector3 centre;
  double radius;          // m
  double mass = 1;        // kg
  double pressure = 50;   // kPR; Pa times m^3
  double modulus = 3000;  // Pa
  double friction = 0.5;  // kDF
};
btSoftBody* add(Application& application, const Ball& ball);

/// Adds a closed surface without pressure that keeps its shape by shape matching.
btSoftBody* add_shell(Application& application, const btVector3& centre, double radius);

/// Adds a large static box whose top is at height 0.
void add_ground(Application& application);

}  // namespace lazyccd::scenes::behaviour
