#include "shapes/tessellation.h"

#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConcaveShape.h>
#include <BulletCollision/CollisionShapes/btConvexShape.h>
#include <BulletCollision/CollisionShapes/btPolyhedralConvexShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <BulletCollision/CollisionShapes/btTriangleCallback.h>
#include <BulletCollision/CollisionShapes/btUniformScalingShape.h>
#include <LinearMath/btConvexHullComputer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "settings.h"
#include "shapes/convex_points.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Of a compound with more children only those near soft bodies are read.
constexpr int max_whole_children = 32;

bool is_finite(const btVector3& p) {
  return std::isfinite(p.x()) && std::isfinite(p.y()) && std::isfinite(p.z());
}

// The triangles so far, by their corners in any order. The detector wants each only once.
class SeenFaces {
 public:
  /// Returns false if a triangle with these corners has been added before.
  bool add(Face face) {
    std::sort(face.begin(), face.end());
    return seen_.insert(face).second;
  }

 private:
  std::set<Face> seen_;
};

// Collects triangles that come one by one. Corners at exactly the same position become one vertex.
// Triangles with a corner that is not finite are left out. `is_mirrored`: a negative scale has
// turned the triangles inside out; they are turned back.
class Welder : public btTriangleCallback {
 public:
  Welder(const btTransform& pose, bool is_mirrored, Triangles& triangles)
      : pose_(pose), is_mirrored_(is_mirrored), triangles_(triangles) {}

  void processTriangle(btVector3* corners, int, int) override {
    if (!std::all_of(corners, corners + 3, is_finite)) return;
    Face face;
    for (int k = 0; k < 3; ++k) face[k] = index_of(corners[k]);
    if (is_mirrored_) std::swap(face[1], face[2]);
    // Skips triangles that are points or lines: their sides belong to neighbours as well.
    if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) return;
    if (seen_.add(face)) triangles_.faces.push_back(face);
  }

 private:
  std::int32_t index_of(const btVector3& p) {
    const auto next = static_cast<std::int32_t>(triangles_.vertices.size());
    const auto [at, is_new] = index_.insert({{p.x(), p.y(), p.z()}, next});
    if (is_new) triangles_.vertices.push_back(pose_ * p);
    return at->second;
  }

  const btTransform& pose_;
  bool is_mirrored_;
  Triangles& triangles_;
  std::map<std::array<btScalar, 3>, std::int32_t> index_;
  SeenFaces seen_;
};

// A square in a plane. Its corners are in the same order as in Bullet's own triangles of a plane.
struct PlaneSquare {
  btVector3 centre, along, across;  // metres; along, across: unit vectors of the sides
  btScalar half;                    // half the side, metres

  PlaneSquare(const btStaticPlaneShape& plane, const AxisBox& box) {
    btPlaneSpace1(plane.getPlaneNormal(), along, across);
    const btVector3 middle = (box.upper + box.lower) / 2;
    centre = middle - (plane.getPlaneNormal().dot(middle) - plane.getPlaneConstant()) *
                          plane.getPlaneNormal();
    half = ((box.upper - box.lower) / 2).length();
  }
  btVector3 corner(int k) const {
    return centre + (k % 4 < 2 ? half : -half) * along +
           (k % 4 == 0 || k % 4 == 3 ? half : -half) * across;
  }
};

// Divides the plane into nested squares; the innermost one covers `near`, the outermost `region`.
void process_plane(const btStaticPlaneShape& plane, const AxisBox& near, const AxisBox& region,
                   btTriangleCallback& triangles) {
  constexpr int ratio = settings::shapes::plane_square_ratio;
  const PlaneSquare all(plane, region);
  PlaneSquare square = near.is_empty() ? all : PlaneSquare(plane, near);
  if (!(square.half > 0) || !(all.half > ratio * square.half)) {
    plane.processAllTriangles(&triangles, region.lower, region.upper);
    return;
  }
  const auto add = [&triangles](const btVector3& a, const btVector3& b, const btVector3& c) {
    btVector3 corners[] = {a, b, c};
    triangles.processTriangle(corners, 0, 0);
  };
  add(square.corner(0), square.corner(1), square.corner(2));
  add(square.corner(2), square.corner(3), square.corner(0));
  const btScalar target_half = all.half + square.centre.distance(all.centre);
  while (square.half < target_half) {
    const PlaneSquare inner = square;
    square.half *= ratio;
    for (int k = 0; k < 4; ++k) {
      add(square.corner(k), square.corner(k + 1), inner.corner(k + 1));
      add(square.corner(k), inner.corner(k + 1), inner.corner(k));
    }
  }
}

bool add_convex(const btConvexShape& shape, const btTransform& pose, double depth,
                Triangles& triangles) {
  const std::vector<btVector3> points = surface_points(shape, depth);
  if (points.size() < 4) return false;
  btConvexHullComputer hull;
  hull.compute(&points[0].getX(), sizeof(btVector3), static_cast<int>(points.size()), 0, 0);
  const auto first = static_cast<std::int32_t>(triangles.vertices.size());
  const auto first_face = static_cast<std::int32_t>(triangles.faces.size());
  for (int i = 0; i < hull.vertices.size(); ++i) {
    // The given points are exact; the coordinates that the hull computes are rounded.
    triangles.vertices.push_back(pose * points[hull.original_vertex_index[i]]);
  }
  SeenFaces seen;  // the hull of points in a plane has a front and a back
  for (int i = 0; i < hull.faces.size(); ++i) {
    const btConvexHullComputer::Edge* const start = &hull.edges[hull.faces[i]];
    const std::int32_t apex = first + start->getSourceVertex();
    for (const auto* edge = start->getNextEdgeOfFace(); edge->getTargetVertex() + first != apex;
         edge = edge->getNextEdgeOfFace()) {
      const Face face = {apex, first + edge->getSourceVertex(), first + edge->getTargetVertex()};
      if (seen.add(face)) triangles.faces.push_back(face);
    }
  }
  if (triangles.faces.size() == static_cast<std::size_t>(first_face)) return false;
  std::array<btVector3, 2> core;
  if (find_core(shape, core)) {
    for (btVector3& end : core) end = pose * end;
    triangles.round_parts.push_back(
        make_round_part(core, triangles.vertices, first, triangles.faces, first_face));
  } else if (ConvexPart part;
             make_hull_part(triangles.vertices, first, triangles.faces, first_face, part)) {
    triangles.convex_parts.push_back(std::move(part));
  }
  return true;
}

}  // namespace

bool tessellate(const btCollisionShape& shape, const btTransform& pose, const AxisBox& region,
                const AxisBox& near, double depth, Triangles& triangles) {
  if (shape.isCompound()) {
    const auto& compound = static_cast<const btCompoundShape&>(shape);
    bool is_complete = true;
    const bool is_cut = is_cut_to_region(shape);
    for (int i = 0; i < compound.getNumChildShapes(); ++i) {
      const btCollisionShape& child = *compound.getChildShape(i);
      const btTransform child_pose = pose * compound.getChildTransform(i);
      AxisBox box;
      child.getAabb(child_pose, box.lower, box.upper);
      if (is_cut && !child.isCompound() && !box.overlaps(region)) {
        triangles.leaves.push_back(
            {child_pose, static_cast<std::int32_t>(triangles.vertices.size())});
        continue;
      }
      is_complete &= tessellate(child, child_pose, region, near, depth, triangles);
    }
    return is_complete;
  }
  triangles.leaves.push_back({pose, static_cast<std::int32_t>(triangles.vertices.size())});
  if (shape.isConvex())
    return add_convex(static_cast<const btConvexShape&>(shape), pose, depth, triangles);
  if (!has_triangles(shape)) return false;
  const auto first_vertex = static_cast<std::int32_t>(triangles.vertices.size());
  const auto first_face = static_cast<std::int32_t>(triangles.faces.size());
  Welder welder(pose, is_mirrored(shape), triangles);
  const AxisBox local = region.transformed(pose.inverse());
  if (shape.getShapeType() == STATIC_PLANE_PROXYTYPE) {
    const auto& plane = static_cast<const btStaticPlaneShape&>(shape);
    process_plane(plane, near.is_empty() ? near : near.transformed(pose.inverse()), local, welder);
    if (triangles.vertices.size() - static_cast<std::size_t>(first_vertex) <=
        ConvexPart::max_vertices)
      triangles.convex_parts.push_back(make_plane_part(pose.getBasis() * plane.getPlaneNormal(),
                                                       triangles.vertices, first_vertex,
                                                       triangles.faces, first_face));
    return true;
  }
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
    const bool counts = without_margin && std::isfinite(shape.getMargin());
    return counts ? static_cast<double>(shape.getMargin()) : 0;
  }
  const auto& compound = static_cast<const btCompoundShape&>(shape);
  double largest = 0;
  for (int i = 0; i < compound.getNumChildShapes(); ++i) {
    largest = std::max(largest, margin_of_triangles(*compound.getChildShape(i)));
  }
  return largest;
}

bool is_mirrored(const btCollisionShape& mesh) {
  const int type = mesh.getShapeType();
  const btVector3& scaling = mesh.getLocalScaling();
  return type != TERRAIN_SHAPE_PROXYTYPE && type != STATIC_PLANE_PROXYTYPE &&
         scaling.x() * scaling.y() * scaling.z() < 0;
}

bool is_cut_to_region(const btCollisionShape& shape) {
  if (!shape.isCompound()) return shape.isConcave();
  const auto& compound = static_cast<const btCompoundShape&>(shape);
  if (compound.getNumChildShapes() > max_whole_children) return true;
  for (int i = 0; i < compound.getNumChildShapes(); ++i) {
    if (is_cut_to_region(*compound.getChildShape(i))) return true;
  }
  return false;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
