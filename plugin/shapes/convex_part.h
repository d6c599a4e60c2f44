// Convex polyhedra and planes: boxes, hulls, and the hulls that stand for cylinders and cones.
#pragma once

#include <LinearMath/btVector3.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/scene.h"
#include "settings.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// A convex polyhedron or a plane among the triangles of a shape, in the frame of the outermost
/// shape.
struct ConvexPart {
  /// A polygon of triangles that lie in one plane.
  struct Side {
    btVector3 normal;                 ///< outward, unit length
    std::vector<std::int32_t> faces;  ///< its triangles, indices of Triangles::faces
  };
  /// An edge between two sides.
  struct Ridge {
    std::array<std::int32_t, 2> sides;     ///< the smaller index first
    std::array<std::int32_t, 2> vertices;  ///< indices of Triangles::vertices
    std::int32_t face;                     ///< a triangle that has it, index of Triangles::faces
    std::int32_t corner;                   ///< it is the triangle's side from this corner, 0 to 2
  };
  static constexpr std::size_t max_sides = settings::shapes::max_convex_sides,
                               max_vertices = settings::shapes::max_convex_vertices;
  std::vector<Side> sides;    ///< one of a plane; at most max_sides
  std::vector<Ridge> ridges;  ///< none of a plane
  /// Its vertices are first_vertex to vertex_end - 1 of Triangles::vertices.
  std::int32_t first_vertex = 0, vertex_end = 0;
  std::int32_t face_count = 0;
};

/// These make the part whose triangles are faces[first_face] to the last one, and whose vertices
/// are vertices[first_vertex] to the last one. A plane has this outward normal. A hull may wind its
/// triangles either way. Sides whose normals differ by less than a milliradian become one. The
/// second function returns false for a hull without triangles, or with too many sides or vertices.
ConvexPart make_plane_part(const btVector3& normal, const std::vector<btVector3>& vertices,
                           std::int32_t first_vertex, const std::vector<Face>& faces,
                           std::int32_t first_face);
bool make_hull_part(const std::vector<btVector3>& vertices, std::int32_t first_vertex,
                    const std::vector<Face>& faces, std::int32_t first_face, ConvexPart& part);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
