#include "tessellation.h"

#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConcaveShape.h>
#include <BulletCollision/CollisionShapes/btConvexShape.h>
#include <BulletCollision/CollisionShapes/btPolyhedralConvexShape.h>
#include <BulletCollision/CollisionShapes/btTriangleCallback.h>
#include <BulletCollision/CollisionShapes/btUniformScalingShape.h>
#include <LinearMath/btAabbUtil2.h>
#include <LinearMath/btConvexHullComputer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <utility>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Triangles that come one by one, with shared corners found by their exact position.
class Welder : public btTriangleCallback {
 public:
  Welder(const btTransform& pose, Triangles& triangles) : pose_(pose), triangles_(triangles) {}

  void processTriangle(btVector3* corners, int, int) override {
    Face face;
    for (int k = 0; k < 3; ++k) face[k] = index_of(corners[k]);
    // A triangle that is a point or a line has its sides in its neighbours.
    if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) return;
    Face sorted = face;
    std::sort(sorted.begin(), sorted.end());
    if (seen_.insert(sorted).second) triangles_.faces.push_back(face);
  }

 private:
  std::int32_t index_of(const btVector3& p) {
    const auto next = static_cast<std::int32_t>(triangles_.vertices.size());
    const auto [at, is_new] = index_.insert({{p.x(), p.y(), p.z()}, next});
    if (is_new) triangles_.vertices.push_back(pose_ * p);
    return at->second;
  }

  const btTransform& pose_;
  Triangles& triangles_;
  std::map<std::array<btScalar, 3>, std::int32_t> index_;
  std::set<Face> seen_;
};

// Points of the unit sphere: an icosahedron whose faces were split in four `splits` times.
std::vector<btVector3> sphere_points(int splits) {
  const btScalar g = (1 + btSqrt(btScalar(5))) / 2;
  std::vector<btVector3> points = {btVector3(-1, g, 0),  btVector3(1, g, 0),   btVector3(-1, -g, 0),
                                   btVector3(1, -g, 0),  btVector3(0, -1, g),  btVector3(0, 1, g),
                                   btVector3(0, -1, -g), btVector3(0, 1, -g),  btVector3(g, 0, -1),
                                   btVector3(g, 0, 1),   btVector3(-g, 0, -1), btVector3(-g, 0, 1)};
  std::vector<Face> faces = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                             {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                             {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                             {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (btVector3& p : points) p.normalize();
  for (int i = 0; i < splits; ++i) {
    std::map<Edge, std::int32_t> middles;
    const auto middle = [&](std::int32_t a, std::int32_t b) {
      const auto next = static_cast<std::int32_t>(points.size());
      const auto [at, is_new] = middles.insert({{std::min(a, b), std::max(a, b)}, next});
      if (is_new) points.push_back((points[a] + points[b]).normalized());
      return at->second;
    };
    std::vector<Face> finer;
    for (const Face& f : faces) {
      const std::int32_t ab = middle(f[0], f[1]), bc = middle(f[1], f[2]), ca = middle(f[2], f[0]);
      for (const Face& part :
           {Face{f[0], ab, ca}, Face{f[1], bc, ab}, Face{f[2], ca, bc}, Face{ab, bc, ca}})
        finer.push_back(part);
    }
    faces = std::move(finer);
  }
  return points;
}

// Directions in whose support points the hull of a cylinder or cone about `axis` is sampled evenly.
std::vector<btVector3> ring_points(int axis) {
  constexpr int around = 48;
  std::vector<btVector3> points;
  for (int i = 0; i < around; ++i) {
    const double angle = 2 * 3.14159265358979323846 * i / around;
    for (const double along : {-0.5, 0.5, 1e3, -1e3}) {
      btVector3 p(0, 0, 0);
      p[axis] = static_cast<btScalar>(along);
      p[(axis + 1) % 3] = static_cast<btScalar>(std::cos(angle));
      p[(axis + 2) % 3] = static_cast<btScalar>(std::sin(angle));
      points.push_back(p.normalized());
    }
  }
  return points;
}

int axis_of(const btConvexShape& shape) {
  // The longest way in which the shape is not round.
  btVector3 lower, upper;
  shape.getAabb(btTransform::getIdentity(), lower, upper);
  const btVector3 size = upper - lower;
  for (int axis = 0; axis < 3; ++axis) {
    const btScalar a = size[(axis + 1) % 3], b = size[(axis + 2) % 3];
    if (btFabs(a - b) <= btScalar(1e-4) * btMax(a, b)) return axis;
  }
  return 1;
}

std::vector<btVector3> surface_points(const btConvexShape& shape) {
  std::vector<btVector3> points;
  if (shape.isPolyhedral()) {
    const auto& polyhedron = static_cast<const btPolyhedralConvexShape&>(shape);
    for (int i = 0; i < polyhedron.getNumVertices(); ++i) {
      points.emplace_back();
      polyhedron.getVertex(i, points.back());
    }
    return points;
  }
  if (shape.getShapeType() == UNIFORM_SCALING_SHAPE_PROXYTYPE) {
    const auto& scaled = static_cast<const btUniformScalingShape&>(shape);
    points = surface_points(*scaled.getChildShape());
    for (btVector3& p : points) p *= scaled.getUniformScalingFactor();
    return points;
  }
  std::vector<btVector3> directions;
  switch (shape.getShapeType()) {
    case SPHERE_SHAPE_PROXYTYPE:
      directions = sphere_points(3);
      break;
    case CYLINDER_SHAPE_PROXYTYPE:
    case CONE_SHAPE_PROXYTYPE:
      directions = ring_points(axis_of(shape));
      break;
    default:
      directions = sphere_points(2);
  }
  for (const btVector3& direction : directions) {
    points.push_back(shape.localGetSupportingVertex(direction));
  }
  return points;
}

bool add_convex(const btConvexShape& shape, const btTransform& pose, Triangles& triangles) {
  const std::vector<btVector3> points = surface_points(shape);
  if (points.size() < 4) return false;
  btConvexHullComputer hull;
  hull.compute(&points[0].getX(), sizeof(btVector3), static_cast<int>(points.size()), 0, 0);
  const auto first = static_cast<std::int32_t>(triangles.vertices.size());
  for (int i = 0; i < hull.vertices.size(); ++i) {
    // The hull's own coordinates are rounded; these are not.
    triangles.vertices.push_back(pose * points[hull.original_vertex_index[i]]);
  }
  for (int i = 0; i < hull.faces.size(); ++i) {
    const btConvexHullComputer::Edge* const start = &hull.edges[hull.faces[i]];
    const std::int32_t apex = first + start->getSourceVertex();
    for (const auto* edge = start->getNextEdgeOfFace(); edge->getTargetVertex() + first != apex;
         edge = edge->getNextEdgeOfFace()) {
      triangles.faces.push_back(
          {apex, first + edge->getSourceVertex(), first + edge->getTargetVertex()});
    }
  }
  return hull.faces.size() > 0;
}

}  // namespace

bool AxisBox::contains(const AxisBox& b) const {
  for (int k = 0; k < 3; ++k) {
    if (b.lower[k] < lower[k] || b.upper[k] > upper[k]) return false;
  }
  return true;
}

bool AxisBox::overlaps(const AxisBox& b) const {
  return TestAabbAgainstAabb2(lower, upper, b.lower, b.upper);
}

AxisBox AxisBox::placed(const btTransform& pose) const {
  AxisBox result;
  btTransformAabb(lower, upper, 0, pose, result.lower, result.upper);
  return result;
}

bool tessellate(const btCollisionShape& shape, const btTransform& pose, const AxisBox& region,
                Triangles& triangles) {
  if (shape.isCompound()) {
    const auto& compound = static_cast<const btCompoundShape&>(shape);
    bool whole = true;
    for (int i = 0; i < compound.getNumChildShapes(); ++i) {
      whole &= tessellate(*compound.getChildShape(i), pose * compound.getChildTransform(i), region,
                          triangles);
    }
    return whole;
  }
  if (shape.isConvex())
    return add_convex(static_cast<const btConvexShape&>(shape), pose, triangles);
  if (!has_triangles(shape)) return false;
  Welder welder(pose, triangles);
  const AxisBox local = region.placed(pose.inverse());
  static_cast<const btConcaveShape&>(shape).processAllTriangles(&welder, local.lower, local.upper);
  return true;
}

bool has_triangles(const btCollisionShape& shape) {
  if (shape.isCompound()) {
    const auto& compound = static_cast<const btCompoundShape&>(shape);
    for (int i = 0; i < compound.getNumChildShapes(); ++i) {
      if (!has_triangles(*compound.getChildShape(i))) return false;
    }
    return true;
  }
  if (shape.isPolyhedral()) {
    return static_cast<const btPolyhedralConvexShape&>(shape).getNumVertices() >= 4;
  }
  if (shape.getShapeType() == UNIFORM_SCALING_SHAPE_PROXYTYPE)
    return has_triangles(*static_cast<const btUniformScalingShape&>(shape).getChildShape());
  return shape.isConvex() || (shape.isConcave() && shape.getShapeType() != SDF_SHAPE_PROXYTYPE &&
                              shape.getShapeType() != EMPTY_SHAPE_PROXYTYPE);
}

double margin_of_triangles(const btCollisionShape& shape) {
  if (shape.getShapeType() == UNIFORM_SCALING_SHAPE_PROXYTYPE) {
    const auto& scaled = static_cast<const btUniformScalingShape&>(shape);
    return margin_of_triangles(*scaled.getChildShape()) *
           static_cast<double>(scaled.getUniformScalingFactor());
  }
  if (!shape.isCompound()) {
    const bool without_margin =
        shape.isConcave() || (shape.isPolyhedral() && shape.getShapeType() != BOX_SHAPE_PROXYTYPE);
    return without_margin ? static_cast<double>(shape.getMargin()) : 0;
  }
  const auto& compound = static_cast<const btCompoundShape&>(shape);
  double largest = 0;
  for (int i = 0; i < compound.getNumChildShapes(); ++i) {
    largest = std::max(largest, margin_of_triangles(*compound.getChildShape(i)));
  }
  return largest;
}

bool is_cut_to_region(const btCollisionShape& shape) {
  if (!shape.isCompound()) return shape.isConcave();
  const auto& compound = static_cast<const btCompoundShape&>(shape);
  for (int i = 0; i < compound.getNumChildShapes(); ++i) {
    if (is_cut_to_region(*compound.getChildShape(i))) return true;
  }
  return false;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
