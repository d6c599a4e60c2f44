// Points on the surface of convex shapes.
#pragma once

#include <BulletCollision/CollisionShapes/btConvexShape.h>

#include <vector>

#include "lazyccd/bullet/precision.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Returns the points whose convex hull stands for the shape, in its own frame. A polyhedron has
/// its vertices. A round shape is sampled so that the hull lies at most about `depth` metres inside
/// it; tessellate() documents the bounds.
std::vector<btVector3> surface_points(const btConvexShape& shape, double depth);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
