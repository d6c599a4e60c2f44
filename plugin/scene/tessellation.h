// Rigid collision shapes as triangles.
//
// Polyhedra and meshes exactly, without their collision margin; boxes, cylinders and cones at their
// full size; what is round by a polyhedron inscribed in it, so that it stays inside the surface at
// which Bullet's own contacts act.
#pragma once

#include <BulletCollision/CollisionShapes/btCollisionShape.h>

#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/scene.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

struct AxisBox {
  btVector3 lower, upper;  // metres

  static AxisBox empty() {
    const btScalar far = BT_LARGE_FLOAT;
    return {btVector3(far, far, far), btVector3(-far, -far, -far)};
  }
  bool is_empty() const { return lower.x() > upper.x(); }
  void add(const btVector3& p) {
    lower.setMin(p);
    upper.setMax(p);
  }
  void add(const AxisBox& b) {
    lower.setMin(b.lower);
    upper.setMax(b.upper);
  }
  bool contains(const AxisBox& b) const;
  bool overlaps(const AxisBox& b) const;
  AxisBox grown(const btVector3& by) const { return {lower - by, upper + by}; }
  // The box around this one after `pose`.
  AxisBox placed(const btTransform& pose) const;
};

struct Triangles {
  std::vector<btVector3> vertices;  // metres, in the frame of the outermost shape
  std::vector<Face> faces;
};

// Appends the triangles of `shape`, which `pose` places. Of meshes and terrains, which may be large
// or without end, those near `region` (a box in the frame of the outermost shape) are enough. The
// corners of planes are as far away as that box reaches, and rounded accordingly; where it reaches
// far beyond `near`, they are cut up so that they are as exact as their distance from there. What
// is round lies about `depth` metres inside its surface at most, but 0.5 % of its radius where that
// is more, and never more than 4.5 %; cylinders and cones, which Bullet rounds by their margin, as
// much besides, or 0.01 of the margin where that is more. False where a part of the shape is of a
// kind without triangles.
bool tessellate(const btCollisionShape& shape, const btTransform& pose, const AxisBox& region,
                const AxisBox& near, double depth, Triangles& triangles);

// Every part of the shape is of a kind with triangles.
bool has_triangles(const btCollisionShape& shape);

// Metres between those triangles and the surface at which Bullet's own contacts act.
double margin_of_triangles(const btCollisionShape& shape);

// The triangles depend on the region.
bool is_cut_to_region(const btCollisionShape& shape);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
