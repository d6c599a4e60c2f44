#include "scenes/meshes/tessellation.h"

#include <BulletCollision/CollisionShapes/btConcaveShape.h>
#include <BulletCollision/CollisionShapes/btConvexShape.h>
#include <BulletCollision/CollisionShapes/btTriangleCallback.h>
#include <LinearMath/btConvexHullComputer.h>

#include <array>
#include <cmath>
#include <map>

namespace lazyccd::scenes {
namespace {

// Collects triangles and merges equal corners.
struct Collector : btTriangleCallback {
  Triangles triangles;
  std::map<std::array<btScalar, 3>, std::int32_t> index_of;

  void processTriangle(btVector3* corners, int, int) override {
    Face face;
    for (int k = 0; k < 3; ++k) {
      const auto next = static_cast<std::int32_t>(triangles.vertices.size());
      const auto entry = index_of.insert({{corners[k].x(), corners[k].y(), corners[k].z()}, next});
      if (entry.second) triangles.vertices.push_back(corners[k]);
      face[k] = entry.first->second;
    }
    triangles.faces.push_back(face);
  }
};

// Returns the convex hull of support points in many directions.
Triangles hull(const btConvexShape& shape) {
  constexpr int directions = 1500;
  constexpr double golden_angle = 2.39996322972865332;
  std::vector<btVector3> points;
  for (int i = 0; i < directions; ++i) {
    // Directions along a spiral that covers the sphere evenly.
    const double y = 1 - 2 * (i + 0.5) / directions, r = std::sqrt(1 - y * y);
    const btVector3 direction(static_cast<btScalar>(r * std::cos(golden_angle * i)),
                              static_cast<btScalar>(y),
                              static_cast<btScalar>(r * std::sin(golden_angle * i)));
    points.push_back(shape.localGetSupportingVertex(direction));
  }
  btConvexHullComputer computer;
  computer.compute(&points[0].x(), sizeof(btVector3), directions, 0, 0);
  Triangles triangles;
  for (int i = 0; i < computer.vertices.size(); ++i) {
    triangles.vertices.push_back(computer.vertices[i]);
  }
  for (int i = 0; i < computer.faces.size(); ++i) {
    const btConvexHullComputer::Edge* first = &computer.edges[computer.faces[i]];
    for (const auto* edge = first->getNextEdgeOfFace();
         edge->getTargetVertex() != first->getSourceVertex(); edge = edge->getNextEdgeOfFace()) {
      triangles.faces.push_back(
          {first->getSourceVertex(), edge->getSourceVertex(), edge->getTargetVertex()});
    }
  }
  return triangles;
}

}  // namespace

Triangles tessellate(const btCollisionShape& shape) {
  if (shape.isConvex()) return hull(static_cast<const btConvexShape&>(shape));
  Collector collector;
  if (shape.isConcave()) {
    constexpr btScalar far = btScalar(1e15);
    static_cast<const btConcaveShape&>(shape).processAllTriangles(
        &collector, btVector3(-far, -far, -far), btVector3(far, far, far));
  }
  return collector.triangles;
}

}  // namespace lazyccd::scenes
