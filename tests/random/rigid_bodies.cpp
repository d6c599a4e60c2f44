#include "random/rigid_bodies.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConeShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btMultiSphereShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <BulletCollision/CollisionShapes/btTetrahedronShape.h>
#include <BulletCollision/CollisionShapes/btUniformScalingShape.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>
#include <LinearMath/btConvexHullComputer.h>

#include <map>

#include "scenes/meshes/shapes.h"

namespace lazyccd::test {
namespace {

using scenes::Triangles;
using scenes::vector;

Triangles hull_of(const std::vector<btVector3>& points) {
  btConvexHullComputer computer;
  computer.compute(&points[0].x(), sizeof(btVector3), static_cast<int>(points.size()), 0, 0);
  Triangles t;
  for (int i = 0; i < computer.vertices.size(); ++i)
    t.vertices.push_back(points[static_cast<std::size_t>(computer.original_vertex_index[i])]);
  for (int i = 0; i < computer.faces.size(); ++i) {
    const btConvexHullComputer::Edge* first = &computer.edges[computer.faces[i]];
    for (const auto* edge = first->getNextEdgeOfFace();
         edge->getTargetVertex() != first->getSourceVertex(); edge = edge->getNextEdgeOfFace())
      t.faces.push_back(
          {first->getSourceVertex(), edge->getSourceVertex(), edge->getTargetVertex()});
  }
  return t;
}

Triangles hull_inside_of(const btConvexShape& shape) {
  constexpr int count = 60;
  RandomSource even(1);
  std::vector<btVector3> points;
  btVector3 middle(0, 0, 0);
  for (int i = 0; i < count; ++i) {
    points.push_back(shape.localGetSupportingVertex(even.direction()));
    middle += points.back() / count;
  }
  for (btVector3& x : points) x = middle.lerp(x, btScalar(0.95));
  return hull_of(points);
}

Triangles box_triangles(const btVector3& half) {
  Triangles t;
  for (int i = 0; i < 8; ++i)
    t.vertices.push_back(half * btVector3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
  t.faces = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
             {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return t;
}

void append(const Triangles& part, const btTransform& pose, Triangles& whole) {
  const auto first = static_cast<std::int32_t>(whole.vertices.size());
  for (const btVector3& x : part.vertices) whole.vertices.push_back(pose * x);
  for (Face face : part.faces) {
    for (std::int32_t& corner : face) corner += first;
    whole.faces.push_back(face);
  }
}

// A square sheet of triangles with random heights.
std::unique_ptr<btTriangleMesh> bumpy(double size, RandomSource& random) {
  const int n = 2 + random.below(7);
  const double height = random.uniform(0, 0.3) * size;
  std::vector<btVector3> points;
  for (int i = 0; i <= n; ++i) {
    for (int k = 0; k <= n; ++k)
      points.push_back(btVector3(scalar((i / double(n) - 0.5) * size),
                                 scalar(height * random.uniform()),
                                 scalar((k / double(n) - 0.5) * size)));
  }
  auto mesh = std::make_unique<btTriangleMesh>();
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < n; ++k) {
      const auto at = [&](int a, int b) -> const btVector3& {
        return points[static_cast<std::size_t>(a * (n + 1) + b)];
      };
      mesh->addTriangle(at(i, k), at(i, k + 1), at(i + 1, k + 1));
      mesh->addTriangle(at(i, k), at(i + 1, k + 1), at(i + 1, k));
    }
  }
  return mesh;
}

// A capsule or a cone, about any axis.
template <class AlongX, class AlongZ, class AlongY>
std::unique_ptr<btConvexInternalShape> round_body(double radius, double height,
                                                  RandomSource& random) {
  const btScalar r = scalar(radius), h = scalar(height);
  switch (random.below(3)) {
    case 0:
      return std::make_unique<AlongX>(r, h);
    case 1:
      return std::make_unique<AlongZ>(r, h);
    default:
      return std::make_unique<AlongY>(r, h);
  }
}

std::unique_ptr<btConvexInternalShape> cylinder(double radius, double half, RandomSource& random) {
  switch (random.below(3)) {
    case 0:
      return std::make_unique<btCylinderShapeX>(vector(half, radius, radius));
    case 1:
      return std::make_unique<btCylinderShapeZ>(vector(radius, radius, half));
    default:
      return std::make_unique<btCylinderShape>(vector(radius, half, radius));
  }
}

Shape hull(const std::string& kind, const std::vector<btVector3>& points) {
  Shape s;
  s.kind = kind;
  s.surface = hull_of(points);
  s.shape = std::make_unique<btConvexHullShape>(&points[0].x(), static_cast<int>(points.size()));
  return s;
}

Shape convex_without_margin(double size, RandomSource& random) {
  Shape s;
  s.round = true;
  const double r = size / 2;
  switch (random.below(10)) {
    case 0:
      s.kind = "sphere";
      s.shape = std::make_unique<btSphereShape>(scalar(r));
      return s;
    case 1:
      s.kind = "capsule";
      s.shape =
          round_body<btCapsuleShapeX, btCapsuleShapeZ, btCapsuleShape>(0.3 * r, 1.4 * r, random);
      return s;
    case 2:
      s.kind = "cylinder";
      s.shape = cylinder(0.5 * r, r * random.uniform(0.05, 1), random);
      return s;
    case 3:
      s.kind = "cone";
      s.shape = round_body<btConeShapeX, btConeShapeZ, btConeShape>(0.5 * r, 2 * r, random);
      return s;
    case 4: {
      s.kind = "spheres";
      const btVector3 centres[] = {random.in_cube(r / 2), random.in_cube(r / 2),
                                   random.in_cube(r / 2)};
      const btScalar radii[] = {scalar(0.1 * r), scalar(0.2 * r), scalar(0.3 * r)};
      s.shape = std::make_unique<btMultiSphereShape>(centres, radii, 3);
      return s;
    }
    case 5: {
      std::vector<btVector3> points;
      for (int i = 5 + random.below(20); i > 0; --i)
        points.push_back(scalar(r) * random.direction());
      return hull("hull", points);
    }
    case 6: {
      const double thin = random.across_scales(1e-4, 0.1) * r;
      return hull("spike", {vector(0, r, 0), vector(thin, -r, 0), vector(-thin, -r, thin),
                            vector(-thin, -r, -thin)});
    }
    case 7: {
      const btVector3 corners[] = {vector(r, 0, -r / 2), vector(-r, 0.1 * r, -r / 2),
                                   vector(0, 0, r), vector(0, r, 0)};
      s.kind = "tetrahedron";
      s.round = false;
      s.shape = std::make_unique<btBU_Simplex1to4>(corners[0], corners[1], corners[2], corners[3]);
      s.surface = hull_of({corners[0], corners[1], corners[2], corners[3]});
      return s;
    }
    default: {
      s.kind = "box";
      s.round = false;
      const btVector3 half =
          vector(r, r * random.across_scales(0.02, 1), r * random.across_scales(0.1, 1));
      s.shape = std::make_unique<btBoxShape>(half);
      s.surface = box_triangles(half);
      return s;
    }
  }
}

Shape convex(double size, double margin, RandomSource& random) {
  Shape s = convex_without_margin(size, random);
  s.shape->setMargin(scalar(margin));
  if (random.chance(0.1)) {
    // In Bullet's own polyhedra only the vertices follow this scaling.
    s.kind += "*2";
    s.parts.push_back(std::move(s.shape));
    s.shape = std::make_unique<btUniformScalingShape>(
        static_cast<btConvexShape*>(s.parts.back().get()), scalar(2));
    for (btVector3& x : s.surface.vertices) x *= 2;
  }
  if (s.round) s.surface = hull_inside_of(static_cast<const btConvexShape&>(*s.shape));
  return s;
}

Shape mesh(double size, RandomSource& random) {
  Shape s;
  s.kind = "mesh";
  s.mesh = bumpy(size, random);
  auto shape = std::make_unique<btBvhTriangleMeshShape>(s.mesh.get(), true);
  const btVector3 scaling =
      vector(random.uniform(0.5, 2), random.uniform(0.5, 2), random.uniform(0.5, 2));
  if (random.chance(0.2)) {
    s.parts.push_back(std::move(shape));
    s.shape = std::make_unique<btScaledBvhTriangleMeshShape>(
        static_cast<btBvhTriangleMeshShape*>(s.parts.back().get()), scaling);
    s.kind = "scaled mesh";
  } else {
    if (random.chance(0.2)) shape->setLocalScaling(scaling);
    s.shape = std::move(shape);
  }
  s.surface = scenes::tessellate(*s.shape);
  s.may_be_dynamic = false;
  return s;
}

// A height field: random up axis, heights as floats or shorts, flat or steep, fine or coarse.
Shape terrain(double size, RandomSource& random) {
  Shape s;
  s.kind = "terrain";
  const int n = 3 + random.below(8), up = random.below(3);
  const double height = random.across_scales(0.01, 1) * size;
  std::unique_ptr<btHeightfieldTerrainShape> shape;
  const bool flipped = random.chance(0.5);
  if (random.chance(0.5)) {
    for (int i = 0; i < n * n; ++i) s.heights.push_back(scalar(height * random.uniform()));
    shape = std::make_unique<btHeightfieldTerrainShape>(n, n, s.heights.data(), scalar(0),
                                                        scalar(height), up, flipped);
  } else {
    for (int i = 0; i < n * n; ++i)
      s.short_heights.push_back(static_cast<short>(random.below(30000)));
    shape = std::make_unique<btHeightfieldTerrainShape>(n, n, s.short_heights.data(),
                                                        scalar(height / 30000), scalar(0),
                                                        scalar(height), up, flipped);
  }
  if (random.chance(0.2)) shape->setUseDiamondSubdivision();
  if (random.chance(0.2)) shape->setUseZigzagSubdivision();
  btVector3 scaling = vector(1, 1, 1) * scalar(size / (n - 1));
  scaling[(up + 1) % 3] *= scalar(random.across_scales(0.2, 1));
  scaling[up] = 1;
  shape->setLocalScaling(scaling);
  s.surface = scenes::tessellate(*shape);
  s.shape = std::move(shape);
  s.may_move = s.may_be_dynamic = false;
  return s;
}

Shape any_shape(double size, double margin, RandomSource& random) {
  switch (random.below(10)) {
    case 0:
      return mesh(size, random);
    case 1: {
      Shape s;
      s.kind = "gimpact";
      s.mesh = bumpy(size, random);
      auto shape = std::make_unique<btGImpactMeshShape>(s.mesh.get());
      if (random.chance(0.3))
        shape->setLocalScaling(vector(random.uniform(0.5, 2), random.uniform(0.5, 2), 1));
      shape->updateBound();
      s.surface = scenes::tessellate(*shape);
      s.shape = std::move(shape);
      return s;
    }
    case 2:
      return terrain(size, random);
    case 3: {
      Shape s;
      s.kind = "compound";
      auto shape = std::make_unique<btCompoundShape>();
      for (int i = 2 + random.below(3); i > 0; --i) {
        Shape part = convex(size / 2, margin, random);
        const btTransform pose(random.rotation(), random.in_cube(size / 4));
        shape->addChildShape(pose, part.shape.get());
        append(part.surface, pose, s.surface);
        s.round = s.round || part.round;
        for (auto& inner : part.parts) s.parts.push_back(std::move(inner));
        s.parts.push_back(std::move(part.shape));
      }
      s.shape = std::move(shape);
      return s;
    }
    case 4: {
      Shape s;
      s.kind = "plane";
      s.shape = std::make_unique<btStaticPlaneShape>(btVector3(0, 1, 0), scalar(0));
      // If the plane is rotated, corners farther away would have rounding errors larger than the
      // gaps that contacts keep.
      const btScalar far = scalar(10 * size);
      s.surface.vertices = {btVector3(-far, 0, -far), btVector3(-far, 0, far),
                            btVector3(far, 0, far), btVector3(far, 0, -far)};
      s.surface.faces = {{0, 1, 2}, {0, 2, 3}};
      s.may_move = s.may_be_dynamic = false;
      return s;
    }
    default:
      return convex(size, margin, random);
  }
}

}  // namespace

Shape random_shape(double size, double margin, RandomSource& random) {
  Shape shape = any_shape(size, margin, random);
  if (!shape.shape->isConvex()) shape.shape->setMargin(scalar(margin));
  return shape;
}

}  // namespace lazyccd::test
