#include "shapes/flat_part.h"

#include <algorithm>
#include <cstddef>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

FlatPart make_flat_part(const std::vector<btVector3>& normals,
                        const std::vector<btVector3>& vertices, std::int32_t first_vertex,
                        const std::vector<Face>& faces, std::int32_t first_face) {
  FlatPart part;
  part.first_vertex = first_vertex;
  part.vertex_end = static_cast<std::int32_t>(vertices.size());
  part.face_count = static_cast<std::int32_t>(faces.size()) - first_face;
  btVector3 centre(0, 0, 0);
  for (std::int32_t v = first_vertex; v < part.vertex_end; ++v) centre += vertices[v];
  centre /= static_cast<btScalar>(vertices.size() - static_cast<std::size_t>(first_vertex));
  for (const btVector3& normal : normals) part.sides.push_back({normal, {}});
  for (auto f = static_cast<std::size_t>(first_face); f < faces.size(); ++f) {
    const btVector3 &a = vertices[faces[f][0]], &b = vertices[faces[f][1]],
                    &c = vertices[faces[f][2]];
    btVector3 normal = (b - a).cross(c - a);
    // The winding of a box's triangles may be either one. A plane has one side.
    if (normals.size() > 1 && normal.dot(a - centre) < 0) normal = -normal;
    const auto is_less_aligned = [&normal](const FlatPart::Side& x, const FlatPart::Side& y) {
      return x.normal.dot(normal) < y.normal.dot(normal);
    };
    std::max_element(part.sides.begin(), part.sides.end(), is_less_aligned)
        ->faces.push_back(static_cast<std::int32_t>(f));
  }
  return part;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
