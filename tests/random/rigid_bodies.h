// Rigid bodies of every shape that Bullet knows, at random, with triangles that say where they are.
#pragma once

#include <BulletCollision/CollisionShapes/btCollisionShape.h>
#include <BulletCollision/CollisionShapes/btTriangleMesh.h>

#include <memory>
#include <string>
#include <vector>

#include "random/random_source.h"
#include "scenes/meshes/tessellation.h"

namespace lazyccd::test {

struct Shape {
  std::unique_ptr<btCollisionShape> shape;
  std::string kind;
  // In the shape's frame: the surface itself where it is flat, a little inside it where it is
  // round.
  scenes::Triangles surface;
  bool round = false;  // somewhere
  bool may_move = true, may_be_dynamic = true;

  // What the shape is made of.
  std::vector<std::unique_ptr<btCollisionShape>> parts;
  std::unique_ptr<btTriangleMesh> mesh;
  std::vector<btScalar> heights;
  std::vector<short> short_heights;
};

// Metres.
Shape random_shape(double size, double margin, RandomSource& random);

}  // namespace lazyccd::test
