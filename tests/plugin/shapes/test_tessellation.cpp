#include "shapes/tessellation.h"

#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btConeShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <BulletCollision/CollisionShapes/btTriangleMesh.h>
#include <BulletCollision/CollisionShapes/btUniformScalingShape.h>

#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <set>

#include "shapes/enclosing_mesh.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::bullet;

namespace {

Triangles triangles_of(const btConvexShape& shape, double depth) {
  Triangles triangles;
  REQUIRE(tessellate(shape, btTransform::getIdentity(), AxisBox::empty(), AxisBox::empty(), depth,
                     triangles));
  return triangles;
}

// Smallest and largest depth of the faces inside the shape.
std::array<double, 2> depths(const btConvexShape& shape, const Triangles& triangles) {
  std::array<double, 2> found = {std::numeric_limits<double>::infinity(), 0};
  for (const Face& face : triangles.faces) {
    const btVector3 &a = triangles.vertices[face[0]], &b = triangles.vertices[face[1]],
                    &c = triangles.vertices[face[2]];
    const btVector3 across = (b - a).cross(c - a);
    if (across.length() < btScalar(1e-6)) continue;  // degenerate triangle in the fan of a cap
    btVector3 normal = across.normalized();
    if (normal.dot(a) < 0) normal = -normal;
    const auto depth = static_cast<double>(normal.dot(shape.localGetSupportingVertex(normal) - a));
    found = {std::min(found[0], depth), std::max(found[1], depth)};
  }
  return found;
}

std::unique_ptr<btConvexShape> make_any(const std::string& kind, btScalar radius) {
  if (kind == "sphere") return std::make_unique<btSphereShape>(radius);
  if (kind == "capsule") return std::make_unique<btCapsuleShapeX>(radius, 3 * radius);
  if (kind == "cylinder")
    return std::make_unique<btCylinderShapeZ>(btVector3(radius, radius, radius / 4));
  return std::make_unique<btConeShape>(radius, 2 * radius);  // as high as it is wide
}

std::unique_ptr<btConvexShape> make(const std::string& kind, btScalar radius) {
  auto shape = make_any(kind, radius);
  shape->setMargin(btScalar(1e-3) * radius);
  return shape;
}

}  // namespace

TEST_CASE("the polyhedron of a round shape lies inside it at about the wanted depth") {
  const std::string kind = GENERATE("sphere", "capsule", "cylinder", "cone");
  const auto shape = make(kind, btScalar(0.3));
  std::size_t faces = 0;
  for (const double depth : {0.009, 0.005, 0.003, 0.0015}) {
    const Triangles triangles = triangles_of(*shape, depth);
    const auto [least, most] = depths(*shape, triangles);
    CHECK(least > -1e-6);
    CHECK(most < 1.27 * depth);  // the number of rings is rounded
    CHECK(triangles.faces.size() > faces);
    faces = triangles.faces.size();
    // The polyhedron is closed and connected.
    std::set<Edge> edges;
    for (const Face& face : triangles.faces) {
      for (int k = 0; k < 3; ++k) CHECK(edges.insert({face[k], face[(k + 1) % 3]}).second);
    }
    for (const Edge& edge : edges) CHECK(edges.count({edge[1], edge[0]}) == 1);
    CHECK(triangles.vertices.size() + faces == edges.size() / 2 + 2);
  }
}

TEST_CASE("the polyhedron of a round shape has limits of fineness and coarseness") {
  const std::string kind = GENERATE("sphere", "capsule", "cylinder", "cone");
  const auto shape = make(kind, 1);
  const double nothing = 0, anything = std::numeric_limits<double>::infinity();
  CHECK(depths(*shape, triangles_of(*shape, nothing))[1] < 0.005);
  CHECK(depths(*shape, triangles_of(*shape, anything))[1] < 0.045);
  CHECK(triangles_of(*shape, nothing).faces.size() < 1600);
}

TEST_CASE("rims that Bullet rounds by the margin are round at small depths") {
  const std::string kind = GENERATE("cylinder", "cone");
  CAPTURE(kind);
  const auto rounded = make_any(kind, btScalar(0.3)), sharp = make(kind, btScalar(0.3));
  rounded->setMargin(btScalar(0.06));
  for (const double depth : {0.005, 0.003, 0.0015}) {
    const auto [least, most] = depths(*rounded, triangles_of(*rounded, depth));
    CHECK(least > -1e-6);
    CHECK(most < 2.3 * depth);
  }
  // At a depth near the margin the rims are not rounded.
  CHECK(triangles_of(*rounded, 0.03).faces.size() == triangles_of(*sharp, 0.03).faces.size());
}

TEST_CASE("a scaled shape has as many triangles as a shape of that size") {
  btSphereShape small(btScalar(0.1));
  const btUniformScalingShape scaled(&small, 3);
  const btSphereShape large(btScalar(0.3));
  CHECK(triangles_of(scaled, 0.003).faces.size() == triangles_of(large, 0.003).faces.size());
}

TEST_CASE("triangles of a plane are exact near bodies however far they extend") {
  const btStaticPlaneShape plane(btVector3(0, 1, 0), btScalar(0.25));
  const btVector3 one(1, 1, 1);
  const auto box = [&](btScalar half) { return AxisBox{-half * one, half * one}; };
  const auto read = [&](const AxisBox& region, const AxisBox& near) {
    Triangles triangles;
    REQUIRE(tessellate(plane, btTransform::getIdentity(), region, near, 0.005, triangles));
    return triangles;
  };
  // Bullet's own two triangles, if more would gain nothing.
  const auto turns_up = [](const Triangles& t, const Face& face) {
    const btVector3& a = t.vertices[face[0]];
    return (t.vertices[face[1]] - a).cross(t.vertices[face[2]] - a).y() > 0;
  };
  const Triangles bullets = read(box(4), box(1));
  CHECK(bullets.faces.size() == 2);
  CHECK(read(box(btScalar(1e7)), AxisBox::empty()).faces.size() == 2);

  const Triangles triangles = read(box(btScalar(1e7)), box(1));
  btVector3 lower = one, upper = one;
  std::map<Edge, int> sides;
  const btTransform pose(btQuaternion(btVector3(1, 2, 3).normalized(), 1), btVector3(1, 2, 3));
  const btVector3 up = pose.getBasis() * btVector3(0, 1, 0);
  for (const Face& face : triangles.faces) {
    CHECK(turns_up(triangles, face) == turns_up(bullets, bullets.faces[0]));
    for (int k = 0; k < 3; ++k) ++sides[{face[k], face[(k + 1) % 3]}];
  }
  int open = 0;
  for (const auto& [side, count] : sides) {
    CHECK(count == 1);
    open += sides.count({side[1], side[0]}) == 0;
  }
  CHECK(open == 4);
  for (const btVector3& x : triangles.vertices) {
    lower.setMin(x);
    upper.setMax(x);
    const btScalar height = up.dot(pose * x - pose * btVector3(0, btScalar(0.25), 0));
    CHECK(std::abs(height) < 1e-6 * (1 + static_cast<double>(x.length())));
  }
  for (const int k : {0, 2}) {
    CHECK(lower[k] <= btScalar(-1e7));
    CHECK(upper[k] >= btScalar(1e7));
  }
}

TEST_CASE("faces of a mesh that a negative scale mirrors still point outwards") {
  const btScalar sign = GENERATE(btScalar(1), btScalar(-1));
  CAPTURE(static_cast<double>(sign));
  const btVector3 corners[4] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  btTriangleMesh mesh;
  for (const auto& face : {Face{0, 2, 1}, Face{0, 1, 3}, Face{0, 3, 2}, Face{1, 2, 3}})
    mesh.addTriangle(corners[face[0]], corners[face[1]], corners[face[2]]);
  btBvhTriangleMeshShape unscaled(&mesh, true);
  const btScaledBvhTriangleMeshShape shape(&unscaled, btVector3(2 * sign, 1, 1));
  bullet::AxisBox region = bullet::AxisBox::empty();
  region.add(btVector3(-3, -3, -3));
  region.add(btVector3(3, 3, 3));
  bullet::Triangles triangles;
  REQUIRE(bullet::tessellate(shape, btTransform::getIdentity(), region, region, 1e-3, triangles));
  double volume = 0;
  for (const Face& face : triangles.faces)
    volume += static_cast<double>(triangles.vertices[face[0]].dot(
                  triangles.vertices[face[1]].cross(triangles.vertices[face[2]]))) /
              6;
  CHECK(volume == Approx(1.0 / 3));
  const btVector3 inside(sign * btScalar(0.4), btScalar(0.2), btScalar(0.2));
  CHECK(bullet::may_be_inside_mesh(shape, inside));
  CHECK_FALSE(bullet::may_be_inside_mesh(shape, -inside));
}
