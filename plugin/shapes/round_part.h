// Balls and capsules: a point or a segment (the core) with a radius. Their triangles lie slightly
// inside the surface.
#pragma once

#include <BulletCollision/CollisionShapes/btConvexShape.h>

#include <array>
#include <cstdint>
#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/scene.h"
#include "shapes/direction_grid.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// A ball or a capsule among the triangles of a shape, in the frame of the outermost shape.
struct RoundPart {
  std::array<btVector3, 2> core;  ///< ends of the segment, metres; equal for a ball
  /// Metres. No triangle lies farther from the core than outer_radius. From within the core, every
  /// face's plane is at least inner_radius away.
  double outer_radius = 0, inner_radius = 0;
  std::int32_t first_face = 0;
  struct Plane {
    btVector3 normal;  ///< outward, unit length
    btScalar offset;   ///< the plane is normal . x = offset, metres
  };
  std::vector<Plane> planes;                      ///< by face
  std::vector<std::array<btVector3, 3>> corners;  ///< by face, metres
  DirectionGrid faces_by_normal;                  ///< where find_exit() looks for faces
};

/// A point on a face.
struct FacePoint {
  std::int32_t face = 0;  ///< in the part
  btScalar u = 0, v = 0;  ///< barycentric coordinates of the face's corners 1 and 2, in [0, 1]
};

/// Finds the core of a ball or a capsule in its own frame. Returns false for other shapes.
bool find_core(const btConvexShape& shape, std::array<btVector3, 2>& core);

/// Makes the part whose triangles are faces[first_face] to the last one, and whose vertices are
/// vertices[first_vertex] to the last one.
RoundPart make_round_part(const std::array<btVector3, 2>& core,
                          const std::vector<btVector3>& vertices, std::int32_t first_vertex,
                          const std::vector<Face>& faces, std::int32_t first_face);

/// Parameter in [0, 1] of the point of the segment that is closest to `x`.
btScalar closest_on_segment(const btVector3& x, const btVector3& a, const btVector3& b);

/// Where a ray from `point` (in the core) along `direction` leaves the triangles.
FacePoint find_exit(const RoundPart& part, const btVector3& point, const btVector3& direction);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
