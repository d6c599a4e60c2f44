// Soft bodies made of tetrahedra, and ropes.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <array>
#include <functional>
#include <memory>

namespace lazyccd::scenes {

/// Makes a body of `cells` x `cells` x `cells` cubes of six tetrahedra each. at(u, v, w) gives the
/// position of a lattice point for u, v, w in [0, 1]. Every side of a tetrahedron is a link; the
/// outside has faces. Node (i, j, k) has the index i + n (j + n k), with n = cells + 1. `mass` in
/// kg, of all nodes together.
std::unique_ptr<btSoftBody> make_solid(
    btSoftBodyWorldInfo& info, int cells, double mass,
    const std::function<btVector3(double u, double v, double w)>& at);

/// Makes a body of cells[0] x cells[1] x cells[2] cubes. Node (i, j, k) has the index
/// i + (cells[0] + 1) (j + (cells[1] + 1) k).
std::unique_ptr<btSoftBody> make_solid(
    btSoftBodyWorldInfo& info, const std::array<int, 3>& cells, double mass,
    const std::function<btVector3(double u, double v, double w)>& at);

/// Makes a solid ball; lengths in metres.
std::unique_ptr<btSoftBody> make_ball(btSoftBodyWorldInfo& info, int cells, double mass,
                                      const btVector3& centre, double radius);

/// Makes a row of linked nodes from one end to the other, without faces.
std::unique_ptr<btSoftBody> make_rope(btSoftBodyWorldInfo& info, int nodes, double mass,
                                      const btVector3& from, const btVector3& to);

/// Makes a rope that is wound round the z axis, with straight ends of the length `end` along the
/// tangents. It begins below the point (radius, 0, 0) and rises by `pitch` a turn; metres.
std::unique_ptr<btSoftBody> make_wound_rope(btSoftBodyWorldInfo& info, int nodes, double mass,
                                            double radius, double turns, double pitch, double end);

}  // namespace lazyccd::scenes
