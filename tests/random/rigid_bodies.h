// Random collision shapes of every kind that Bullet has, with triangles of their surfaces.
#pragma once

#include <BulletCollision/CollisionShapes/btCollisionShape.h>
#include <BulletCollision/CollisionShapes/btTriangleMesh.h>

#include <memory>
#include <string>
#include <vector>

#include "random/random_source.h"
#include "scenes/meshes/tessellation.h"

namespace lazyccd::test {

/// A collision shape, its triangles, and the memory that it refers to.
struct Shape {
  std::unique_ptr<btCollisionShape> shape;
  std::string kind;
  /// Triangles in the shape's frame. Flat parts of the surface are exact; round parts lie slightly
  /// inside the shape.
  scenes::Triangles surface;
  bool round = false;  ///< some part of the surface is round
  bool may_move = true, may_be_dynamic = true;

  /// Memory that `shape` refers to.
  std::vector<std::unique_ptr<btCollisionShape>> parts;
  std::unique_ptr<btTriangleMesh> mesh;
  std::vector<btScalar> heights;
  std::vector<short> short_heights;
};

/// `size`: approximate width, metres. `margin`: collision margin, metres.
Shape random_shape(double size, double margin, RandomSource& random);

}  // namespace lazyccd::test
