#include "random/rigid_bodies.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConeShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>
#include <LinearMath/btConvexHullComputer.h>

#include <map>

namespace lazyccd::test {
namespace {

using scenes::Triangles;

btScalar scalar(double x) { return static_cast<btScalar>(x); }

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
  Dice even(1);
  std::vector<btVector3> points;
  for (int i = 0; i < 60; ++i)
    points.push_back(scalar(0.95) * shape.localGetSupportingVertex(even.direction()));
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

// A bumpy sheet of triangles, folded up by `fold`.
std::unique_ptr<btTriangleMesh> bumpy(double size, Dice& dice) {
  const int n = 2 + dice.below(7);
  const double height = dice.uniform(0, 0.3) * size;
  std::vector<btVector3> points;
  for (int i = 0; i <= n; ++i) {
    for (int k = 0; k <= n; ++k)
      points.push_back(btVector3(scalar((i / double(n) - 0.5) * size),
                                 scalar(height * dice.uniform()),
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

Shape convex(double size, double margin, Dice& dice) {
  Shape s;
  const double r = size / 2;
  switch (dice.below(7)) {
    case 0:
      s.kind = "sphere";
      s.shape = std::make_unique<btSphereShape>(scalar(r));
      break;
    case 1:
      s.kind = "capsule";
      s.shape = std::make_unique<btCapsuleShape>(scalar(0.3 * r), scalar(1.4 * r));
      break;
    case 2:
      s.kind = "cylinder";
      s.shape = std::make_unique<btCylinderShape>(
          btVector3(scalar(0.5 * r), scalar(r * dice.uniform(0.05, 1)), scalar(0.5 * r)));
      break;
    case 3:
      s.kind = "cone";
      s.shape = std::make_unique<btConeShape>(scalar(0.5 * r), scalar(2 * r));
      break;
    case 4: {
      s.kind = "hull";
      auto shape = std::make_unique<btConvexHullShape>();
      std::vector<btVector3> points;
      for (int i = 5 + dice.below(20); i > 0; --i) {
        points.push_back(scalar(r) * dice.direction());
        shape->addPoint(points.back());
      }
      s.surface = hull_of(points);
      shape->setMargin(scalar(margin));
      s.shape = std::move(shape);
      return s;
    }
    default: {
      s.kind = "box";
      const btVector3 half(scalar(r), scalar(r * dice.across_scales(0.02, 1)),
                           scalar(r * dice.across_scales(0.1, 1)));
      s.shape = std::make_unique<btBoxShape>(half);
      s.shape->setMargin(scalar(margin));
      s.surface = box_triangles(half);
      return s;
    }
  }
  s.shape->setMargin(scalar(margin));
  s.round = true;
  s.surface = hull_inside_of(static_cast<const btConvexShape&>(*s.shape));
  return s;
}

Shape any_shape(double size, double margin, Dice& dice) {
  switch (dice.below(10)) {
    case 0: {
      Shape s;
      s.kind = "mesh";
      s.mesh = bumpy(size, dice);
      s.shape = std::make_unique<btBvhTriangleMeshShape>(s.mesh.get(), true);
      s.surface = scenes::tessellate(*s.shape);
      s.may_be_dynamic = false;
      return s;
    }
    case 1: {
      Shape s;
      s.kind = "gimpact";
      s.mesh = bumpy(size, dice);
      auto shape = std::make_unique<btGImpactMeshShape>(s.mesh.get());
      shape->updateBound();
      s.surface = scenes::tessellate(*shape);
      s.shape = std::move(shape);
      s.may_be_dynamic = false;
      return s;
    }
    case 2: {
      Shape s;
      s.kind = "terrain";
      const int n = 3 + dice.below(8);
      for (int i = 0; i < n * n; ++i) s.heights.push_back(scalar(0.2 * size * dice.uniform()));
      auto shape = std::make_unique<btHeightfieldTerrainShape>(n, n, s.heights.data(), scalar(0),
                                                               scalar(0.2 * size), 1, false);
      shape->setLocalScaling(btVector3(scalar(size / (n - 1)), 1, scalar(size / (n - 1))));
      s.surface = scenes::tessellate(*shape);
      s.shape = std::move(shape);
      s.may_move = s.may_be_dynamic = false;
      return s;
    }
    case 3: {
      Shape s;
      s.kind = "compound";
      auto shape = std::make_unique<btCompoundShape>();
      for (int i = 2 + dice.below(3); i > 0; --i) {
        Shape part = convex(size / 2, margin, dice);
        const btTransform pose(dice.rotation(), dice.in_cube(size / 4));
        shape->addChildShape(pose, part.shape.get());
        append(part.surface, pose, s.surface);
        s.round = s.round || part.round;
        s.parts.push_back(std::move(part.shape));
      }
      s.shape = std::move(shape);
      return s;
    }
    case 4: {
      Shape s;
      s.kind = "plane";
      s.shape = std::make_unique<btStaticPlaneShape>(btVector3(0, 1, 0), scalar(0));
      const btScalar far = scalar(1000 * size);
      s.surface.vertices = {btVector3(-far, 0, -far), btVector3(-far, 0, far),
                            btVector3(far, 0, far), btVector3(far, 0, -far)};
      s.surface.faces = {{0, 1, 2}, {0, 2, 3}};
      s.may_move = s.may_be_dynamic = false;
      return s;
    }
    default:
      return convex(size, margin, dice);
  }
}

}  // namespace

Shape random_shape(double size, double margin, Dice& dice) {
  Shape shape = any_shape(size, margin, dice);
  if (!shape.shape->isConvex()) shape.shape->setMargin(scalar(margin));
  return shape;
}

}  // namespace lazyccd::test
