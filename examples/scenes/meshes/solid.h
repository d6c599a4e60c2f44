// Soft bodies of tetrahedra, and ropes.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <functional>
#include <memory>

namespace lazyccd::scenes {

// `cells` x `cells` x `cells` cubes of six tetrahedra each, at(u, v, w) giving the position of a
// lattice point for u, v, w in [0, 1]; links along all sides of tetrahedra, faces on the outside.
// Node (i, j, k) has the index i + n (j + n k), n = cells + 1. `mass` in kg, over all nodes.
std::unique_ptr<btSoftBody> make_solid(
    btSoftBodyWorldInfo& info, int cells, double mass,
    const std::function<btVector3(double u, double v, double w)>& at);

// A solid ball.
std::unique_ptr<btSoftBody> make_ball(btSoftBodyWorldInfo& info, int cells, double mass,
                                      const btVector3& centre, double radius);

// Nodes in a row from one end to the other, linked, without faces.
std::unique_ptr<btSoftBody> make_rope(btSoftBodyWorldInfo& info, int nodes, double mass,
                                      const btVector3& from, const btVector3& to);

}  // namespace lazyccd::scenes
