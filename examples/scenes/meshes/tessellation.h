// Surfaces of rigid bodies as triangles, for the counters and for pictures.
#pragma once

#include <BulletCollision/CollisionShapes/btCollisionShape.h>

#include <vector>

#include "lazyccd/scene.h"

namespace lazyccd::scenes {

/// A triangle mesh.
struct Triangles {
  std::vector<btVector3> vertices;
  std::vector<Face> faces;
};

/// Returns the surface of a shape, in the shape's own frame. A mesh gives its triangles, with equal
/// corners merged into one vertex. A convex shape gives the convex hull of 1500 points on it. Other
/// shapes give nothing.
Triangles tessellate(const btCollisionShape& shape);

}  // namespace lazyccd::scenes
