// How surfaces of triangles turn at their edges and vertices.
#include "shapes/surface_bends.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btConeShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "shapes/tessellation.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::bullet;

namespace {

struct Surface {
  std::vector<Face> faces;
  std::vector<Edge> edges;
  std::vector<btScalar> positions;
  SurfaceBends bends;

  Surface(std::vector<Face> all_faces, const std::vector<btVector3>& vertices)
      : faces(std::move(all_faces)) {
    std::set<std::array<std::int32_t, 2>> sorted;  // larger index first
    for (const Face& face : faces)
      for (int k = 0; k < 3; ++k) {
        const std::int32_t a = face[k], b = face[(k + 1) % 3];
        sorted.insert({std::max(a, b), std::min(a, b)});
      }
    for (const auto& [larger, smaller] : sorted) edges.push_back({smaller, larger});
    for (const btVector3& x : vertices) positions.insert(positions.end(), {x[0], x[1], x[2]});
    bends = measure_bends(faces, edges, positions, 0);
  }

  std::int64_t sharp_edges() const {
    return std::count_if(bends.angles.begin(), bends.angles.end(),
                         [](float angle) { return std::isinf(angle); });
  }
  double angle_between(std::int32_t a, std::int32_t b) const {
    const auto at = std::find(edges.begin(), edges.end(), Edge{std::min(a, b), std::max(a, b)});
    return static_cast<double>(bends.angles[static_cast<std::size_t>(at - edges.begin())]);
  }
};

Surface surface_of(const btConvexShape& shape) {
  Triangles triangles;
  REQUIRE(tessellate(shape, btTransform::getIdentity(), AxisBox::empty(), AxisBox::empty(), 1e-3,
                     triangles));
  return Surface(triangles.faces, triangles.vertices);
}

// Two triangles at the edge 0 1. The second one is turned by `angle`.
Surface hinge(double angle, bool turned_over = false) {
  const auto point = [](double x, double y, double z) {
    return btVector3(static_cast<btScalar>(x), static_cast<btScalar>(y), static_cast<btScalar>(z));
  };
  const Face second = turned_over ? Face{0, 1, 3} : Face{1, 0, 3};
  return Surface({{0, 1, 2}, second}, {point(0, 0, 0), point(0, 0, 2), point(-0.5, 0, 1),
                                       point(0.5 * std::cos(angle), 0.5 * std::sin(angle), 1)});
}

}  // namespace

TEST_CASE("an edge turns by the angle between its faces, or is sharp") {
  for (const double angle : {0.0, 0.1, -0.3}) {
    const Surface surface = hinge(angle);
    CHECK(surface.angle_between(0, 1) == Approx(std::abs(angle)).margin(1e-3));
    CHECK(surface.sharp_edges() == 4);  // the border
    CHECK(static_cast<double>(surface.bends.curvatures[0]) ==
          Approx(std::abs(angle) / 0.5).margin(3e-3));
    CHECK(static_cast<double>(surface.bends.vertex_angles[0]) ==
          Approx(std::abs(angle)).margin(1e-3));
  }
  CHECK(std::isinf(hinge(0.6).angle_between(0, 1)));
  CHECK(std::isinf(hinge(0.1, true).angle_between(0, 1)));
}

TEST_CASE("of a box the diagonals of its sides are flat") {
  const Surface box = surface_of(btBoxShape(btVector3(1, 2, 3)));
  CHECK(box.edges.size() == 18);
  CHECK(box.sharp_edges() == 12);
  for (const float angle : box.bends.vertex_angles) CHECK(angle == 0);
  for (const float curvature : box.bends.vertex_curvatures) CHECK(std::isinf(curvature));
}

TEST_CASE("the side of a cylinder turns by equal angles, and a cone turns most at its apex") {
  const Surface cylinder = surface_of(btCylinderShape(btVector3(1, 1, 1)));
  std::set<double> angles;
  for (const float angle : cylinder.bends.angles)
    if (!std::isinf(angle)) angles.insert(std::round(1e3 * static_cast<double>(angle)) / 1e3);
  const double largest = *angles.rbegin();
  CHECK(*angles.begin() == 0);
  CHECK(std::abs(2 * M_PI / largest - std::round(2 * M_PI / largest)) < 0.2);

  btConeShape shape(1, 1);
  shape.setMargin(btScalar(1e-4));  // no rounded rims
  const Surface cone = surface_of(shape);
  const auto& turns = cone.bends.vertex_angles;
  CHECK(static_cast<double>(*std::max_element(turns.begin(), turns.end())) > 1);
}
