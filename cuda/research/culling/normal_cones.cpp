#include "research/culling/normal_cones.h"

#include <algorithm>
#include <cmath>

namespace lazyccd::research {
namespace {

// Returns whether the closed curve is simple: two sides meet only in the common vertex of
// neighbours.
bool simple(const Contour& contour, const std::vector<Contour::Seen>& points) {
  const std::size_t n = points.size();
  std::vector<Contour::Side> sides;
  for (std::size_t i = 0; i < n; ++i) sides.emplace_back(points[i], points[(i + 1) % n]);
  for (std::size_t i = 0; i < n; ++i) {
    if (!contour.turns(points[i], points[(i + 1) % n], points[(i + 2) % n])) return false;
    const std::size_t end = i == 0 ? n - 1 : n;
    for (std::size_t j = i + 2; j < end; ++j)
      if (!contour.apart(sides[i], sides[j])) return false;
  }
  return true;
}

}  // namespace

void NormalCones::refit(const Mesh& mesh, const Tree& tree,
                        const std::vector<VertexRecord>& vertices, ThreadPool& pool) {
  const std::vector<std::int32_t>& faces = patches_.faces();
  face_cones_.resize(faces.size());
  pool.parallel_for(faces.size(), 1024, [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i) {
      const Face& face = mesh.faces()[faces[i]];
      face_cones_[i] = views_of_face(vertices[face[0]].x, vertices[face[1]].x, vertices[face[2]].x);
    }
  });
  cones_.resize(tree.nodes().size());
  tree.for_each_upward(pool, [&](std::size_t i) {
    const TreeNode& node = tree.nodes()[i];
    if (!node.leaf()) {
      cones_[i] = cones_[node.left] & cones_[node.right()];
      return;
    }
    Directions all = ~Directions{0};
    const std::int32_t leaf = tree.ranges()[i].first;
    for (std::uint32_t f = patches_.first_face(leaf); f < patches_.first_face(leaf + 1); ++f)
      all &= face_cones_[f];
    cones_[i] = all;
  });
}

bool NormalCones::apart_from_itself(std::uint32_t node,
                                    const std::vector<VertexRecord>& vertices) const {
  const Span<const std::int32_t> boundary = patches_.boundary(node);
  const int seen_along = view_of(cones_[node]);
  if (boundary.empty() || seen_along < 0) return false;
  double size = 0;
  for (const std::int32_t v : boundary)
    for (int k = 0; k < 6; ++k) size = std::max(size, std::fabs(vertices[v].x[k]));
  const Contour contour(view(seen_along), size);
  std::vector<Contour::Seen> points;
  for (const std::int32_t v : boundary) points.push_back(contour.seen(vertices[v].x));
  return simple(contour, points);
}

std::size_t NormalCones::bytes() const {
  return patches_.bytes() + (face_cones_.capacity() + cones_.capacity()) * sizeof(Directions);
}

}  // namespace lazyccd::research
