// Surfaces of rigid bodies as triangles, for the counters and for pictures.
#pragma once

#include <BulletCollision/CollisionShapes/btCollisionShape.h>

#include <vector>

#include "lazyccd/scene.h"

namespace lazyccd::scenes {

struct Triangles {
  std::vector<btVector3> vertices;
  std::vector<Face> faces;
};

// In the shape's own frame. Of a mesh its triangles, equal corners as one vertex; of a convex shape
// the hull of many points on it; of others nothing.
Triangles tessellate(const btCollisionShape& shape);

}  // namespace lazyccd::scenes
