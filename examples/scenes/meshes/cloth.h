// Rectangular cloth.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <functional>
#include <memory>
#include <random>

namespace lazyccd::scenes {

// Nodes in rows: columns x rows, at(u, v) giving the position for u, v in [0, 1] along columns and
// rows. Links along both directions and the diagonals of the faces. `mass` in kg, over all nodes.
std::unique_ptr<btSoftBody> make_cloth(btSoftBodyWorldInfo& info, int columns, int rows,
                                       double mass,
                                       const std::function<btVector3(double u, double v)>& at);

struct Sheet {
  int columns, rows;
  double width, length;  // m, along x and z
  double height = 0;     // m
  double angle = 0;      // rad, about the vertical
  double jitter = 0;     // m, largest random offset of a node along each axis
  double mass = 1;       // kg
};
std::unique_ptr<btSoftBody> make_sheet(btSoftBodyWorldInfo& info, const Sheet& sheet,
                                       std::mt19937& random);

// Infinite mass for the nodes on the four sides.
void pin_border(btSoftBody& cloth, int columns, int rows);
void pin(btSoftBody& body, int first_node, int last_node);
// Sets the velocity that brings a pinned node to a place in one step of `dt` seconds.
void steer(btSoftBody::Node& node, const btVector3& goal, double dt);

}  // namespace lazyccd::scenes
