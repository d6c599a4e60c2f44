#include "shapes/convex_part.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <numeric>
#include <utility>

#include "settings.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

ConvexPart part_of(const std::vector<btVector3>& vertices, std::int32_t first_vertex,
                   const std::vector<Face>& faces, std::int32_t first_face) {
  ConvexPart part;
  part.first_vertex = first_vertex;
  part.vertex_end = static_cast<std::int32_t>(vertices.size());
  part.face_count = static_cast<std::int32_t>(faces.size()) - first_face;
  return part;
}

// Sets the ridges; `side_of_face`: by face, from first_face.
void find_ridges(const std::vector<Face>& faces, std::int32_t first_face,
                 const std::vector<std::int32_t>& side_of_face, ConvexPart& part) {
  std::map<Edge, std::int32_t> first_side;  // of an edge that one face had so far
  for (std::size_t i = 0; i < side_of_face.size(); ++i) {
    const auto index = first_face + static_cast<std::int32_t>(i);
    const Face& face = faces[static_cast<std::size_t>(index)];
    for (std::int32_t k = 0; k < 3; ++k) {
      const std::int32_t a = face[k], b = face[(k + 1) % 3], side = side_of_face[i];
      const auto [at, is_new] = first_side.insert({{std::min(a, b), std::max(a, b)}, side});
      if (is_new || at->second == side) continue;
      part.ridges.push_back(
          {{std::min(at->second, side), std::max(at->second, side)}, {a, b}, index, k});
    }
  }
}

}  // namespace

ConvexPart make_plane_part(const btVector3& normal, const std::vector<btVector3>& vertices,
                           std::int32_t first_vertex, const std::vector<Face>& faces,
                           std::int32_t first_face) {
  ConvexPart part = part_of(vertices, first_vertex, faces, first_face);
  part.sides.push_back({normal, std::vector<std::int32_t>(part.face_count)});
  std::iota(part.sides[0].faces.begin(), part.sides[0].faces.end(), first_face);
  return part;
}

bool make_hull_part(const std::vector<btVector3>& vertices, std::int32_t first_vertex,
                    const std::vector<Face>& faces, std::int32_t first_face, ConvexPart& part) {
  part = part_of(vertices, first_vertex, faces, first_face);
  if (static_cast<std::size_t>(part.vertex_end - first_vertex) > ConvexPart::max_vertices)
    return false;
  btVector3 centre(0, 0, 0);
  for (std::int32_t v = first_vertex; v < part.vertex_end; ++v) centre += vertices[v];
  centre /= static_cast<btScalar>(part.vertex_end - first_vertex);
  // The largest triangle of a side gives its normal: that of a narrow one is rounded.
  struct Triangle {
    std::int32_t index;
    btScalar area;
    btVector3 normal;
  };
  std::vector<Triangle> triangles;
  for (auto f = first_face; f < static_cast<std::int32_t>(faces.size()); ++f) {
    const btVector3 &a = vertices[faces[f][0]], &b = vertices[faces[f][1]],
                    &c = vertices[faces[f][2]];
    btVector3 normal = (b - a).cross(c - a);
    if (normal.dot(a - centre) < 0) normal = -normal;
    const btScalar area = normal.length();
    if (area > 0) normal /= area;
    triangles.push_back({f, area, normal});
  }
  std::stable_sort(triangles.begin(), triangles.end(),
                   [](const Triangle& a, const Triangle& b) { return a.area > b.area; });
  std::vector<std::int32_t> side_of_face(triangles.size());
  for (const Triangle& triangle : triangles) {
    auto side = std::find_if(part.sides.begin(), part.sides.end(), [&](const auto& s) {
      return s.normal.dot(triangle.normal) >= btScalar(settings::shapes::min_same_side_cosine);
    });
    if (side == part.sides.end()) {
      if (part.sides.size() == ConvexPart::max_sides) return false;
      part.sides.push_back({triangle.normal, {}});
      side = part.sides.end() - 1;
    }
    side->faces.push_back(triangle.index);
    side_of_face[static_cast<std::size_t>(triangle.index - first_face)] =
        static_cast<std::int32_t>(side - part.sides.begin());
  }
  find_ridges(faces, first_face, side_of_face, part);
  return !part.sides.empty();
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
