// Rectangular pieces of cloth.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <functional>
#include <memory>
#include <random>

namespace lazyccd::scenes {

/// Makes a cloth of columns x rows nodes, numbered row by row. at(u, v) gives the position for u, v
/// in [0, 1] along columns and rows. Links run along both directions and along the diagonals of the
/// faces. `mass` in kg, of all nodes together.
std::unique_ptr<btSoftBody> make_cloth(btSoftBodyWorldInfo& info, int columns, int rows,
                                       double mass,
                                       const std::function<btVector3(double u, double v)>& at);

/// A level rectangular cloth.
struct Sheet {
  int columns, rows;
  double width, length;  // m, along x and z
  double height = 0;     // m
  double angle = 0;      // rad, about the vertical axis
  double jitter = 0;     // m, largest random offset of a node along each axis
  double mass = 1;       // kg
};
std::unique_ptr<btSoftBody> make_sheet(btSoftBodyWorldInfo& info, const Sheet& sheet,
                                       std::mt19937& random);

/// Pins the nodes of the four sides by giving them infinite mass.
void pin_border(btSoftBody& cloth, int columns, int rows);
void pin(btSoftBody& body, int first_node, int last_node);
/// Sets the velocity that moves a pinned node to `goal` in one step of `dt` seconds.
void steer(btSoftBody::Node& node, const btVector3& goal, double dt);

}  // namespace lazyccd::scenes
