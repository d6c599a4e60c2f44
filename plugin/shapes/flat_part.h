// Boxes and planes: convex, with few and large faces.
#pragma once

#include <LinearMath/btVector3.h>

#include <cstdint>
#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/scene.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// A box or a plane among the triangles of a shape, in the frame of the outermost shape.
struct FlatPart {
  /// A side: all of the part lies on it or behind it.
  struct Side {
    btVector3 normal;                 ///< outward, unit length
    std::vector<std::int32_t> faces;  ///< its triangles, indices of Triangles::faces
  };
  std::vector<Side> sides;  ///< six of a box, one of a plane
  /// Its vertices are first_vertex to vertex_end - 1 of Triangles::vertices.
  std::int32_t first_vertex = 0, vertex_end = 0;
  std::int32_t face_count = 0;
};

/// Makes the part of a box or plane with these outward normals. Its triangles are
/// faces[first_face] to the last one, and its vertices vertices[first_vertex] to the last one.
FlatPart make_flat_part(const std::vector<btVector3>& normals,
                        const std::vector<btVector3>& vertices, std::int32_t first_vertex,
                        const std::vector<Face>& faces, std::int32_t first_face);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
