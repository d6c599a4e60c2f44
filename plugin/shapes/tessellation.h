// Triangles of rigid collision shapes.
//
// Polyhedra and meshes are exact and without their collision margin. Boxes, cylinders and cones
// have their full size. A round shape becomes an inscribed polyhedron, which therefore stays inside
// the surface at which Bullet's own contacts act.
#pragma once

#include <BulletCollision/CollisionShapes/btCollisionShape.h>

#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/scene.h"
#include "shapes/axis_box.h"
#include "shapes/convex_part.h"
#include "shapes/round_part.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

struct Triangles {
  /// A shape that is no compound: where it is in the outermost one, and its first vertex.
  struct Leaf {
    btTransform pose;
    std::int32_t first_vertex;
  };

  std::vector<btVector3> vertices;  ///< metres, in the frame of the outermost shape
  std::vector<Leaf> leaves;         ///< all of them, also those without triangles
  std::vector<Face> faces;
  std::vector<RoundPart> round_parts;    ///< balls and capsules among them, by first_face
  std::vector<ConvexPart> convex_parts;  ///< planes, and convex shapes that are not round
  /// True if all faces belong to these parts.
  bool is_simple() const {
    return !faces.empty() && round_faces() + convex_faces() == faces.size();
  }
  /// True if all faces belong to balls and capsules.
  bool is_round() const { return !faces.empty() && round_faces() == faces.size(); }

 private:
  std::size_t round_faces() const {
    std::size_t count = 0;
    for (const RoundPart& part : round_parts) count += part.planes.size();
    return count;
  }
  std::size_t convex_faces() const {
    std::size_t count = 0;
    for (const ConvexPart& part : convex_parts) count += static_cast<std::size_t>(part.face_count);
    return count;
  }
};

/// Appends the triangles of `shape` at `pose`. Returns false if a part of the shape is of a kind
/// without triangles. `region` and `near` are boxes in the frame of the outermost shape.
///  - Meshes and terrains, which may be large or infinite: at least the triangles near `region`.
///  - Planes: a square as large as `region`. Its corners are rounded in proportion to their
///    distance. If `region` reaches far beyond `near`, the square is divided into nested squares
///    around `near`, so that each corner is as exact as its distance from there.
///  - Round shapes: at most about `depth` metres inside the surface, or 0.5 % of the radius if that
///    is more, but never more than 4.5 %.
///  - Cylinders and cones, whose rims Bullet rounds by the margin: there the same distance in
///    addition, or 0.01 of the margin if that is more.
bool tessellate(const btCollisionShape& shape, const btTransform& pose, const AxisBox& region,
                const AxisBox& near, double depth, Triangles& triangles);

/// True if every part of the shape is of a kind with triangles.
bool has_triangles(const btCollisionShape& shape);

/// Distance between those triangles and the surface at which Bullet's own contacts act, metres.
double margin_of_triangles(const btCollisionShape& shape);

/// True if a negative scale turns Bullet's triangles of a mesh inside out. tessellate() turns them
/// back.
bool is_mirrored(const btCollisionShape& mesh);

/// True if the triangles depend on the region.
bool is_cut_to_region(const btCollisionShape& shape);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
