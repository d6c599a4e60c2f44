#include "scene/tessellation.h"

#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConcaveShape.h>
#include <BulletCollision/CollisionShapes/btConeShape.h>
#include <BulletCollision/CollisionShapes/btConvexShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btPolyhedralConvexShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
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

// Collects triangles that come one by one. Corners at exactly the same position become one vertex.
class Welder : public btTriangleCallback {
 public:
  Welder(const btTransform& pose, Triangles& triangles) : pose_(pose), triangles_(triangles) {}

  void processTriangle(btVector3* corners, int, int) override {
    Face face;
    for (int k = 0; k < 3; ++k) face[k] = index_of(corners[k]);
    // Skips triangles that are points or lines: their sides belong to neighbours as well.
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
  constexpr btScalar ratio = 8;  // of the sides of two successive squares
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

constexpr double pi = 3.14159265358979323846;

// Directions at one latitude, evenly spaced about an axis.
struct Ring {
  double latitude;  // rad
  int points;
  double rotation = 0;  // of the first point, as a fraction of the distance between two points
};

std::vector<btVector3> directions_in(const std::vector<Ring>& rings, int axis) {
  std::vector<btVector3> directions;
  for (const Ring& ring : rings) {
    for (int i = 0; i < ring.points; ++i) {
      const double angle = 2 * pi * (i + ring.rotation) / ring.points;
      btVector3 p(0, 0, 0);
      p[axis] = static_cast<btScalar>(std::sin(ring.latitude));
      p[(axis + 1) % 3] = static_cast<btScalar>(std::cos(ring.latitude) * std::cos(angle));
      p[(axis + 2) % 3] = static_cast<btScalar>(std::cos(ring.latitude) * std::sin(angle));
      directions.push_back(p);
    }
  }
  return directions;
}

// Returns rings for a ball; `count`: number of rings between the equator and a pole. The hull of
// their points lies at most 0.7 / count^2 of the radius inside the ball.
std::vector<Ring> rings_of_ball(int count) {
  const double step = pi / 2 / count, spacing = 1.1 * step;
  std::vector<Ring> rings;
  for (int i = -count; i <= count; ++i) {
    const double circumference = 2 * pi * std::cos(i * step);
    rings.push_back({i * step, std::max(1, static_cast<int>(std::lround(circumference / spacing))),
                     i % 2 == 0 ? 0.0 : 0.5});
  }
  return rings;
}

// Number of rings for rings_of_ball() so that the hull lies at most about `depth` inside the ball.
int ring_count(double radius, double depth) {
  constexpr int min_rings = 4, max_rings = 12;
  const double count = std::sqrt(0.7 * radius / depth);
  return count < max_rings ? std::max(min_rings, static_cast<int>(std::lround(count))) : max_rings;
}

// Like rings_of_ball(), but with two equators, one for each end of the capsule's cylinder.
std::vector<Ring> rings_of_capsule(int count) {
  constexpr double equator_offset = 1e-4;  // rad
  std::vector<Ring> rings = rings_of_ball(count);
  Ring& equator = rings[static_cast<std::size_t>(count)];
  equator.latitude = -equator_offset;
  Ring other = equator;
  other.latitude = equator_offset;
  rings.push_back(other);
  return rings;
}

// Returns rings for a cylinder or cone: two for its side and two for its ends. Bullet rounds the
// rims by the margin; rings at a spacing of t rad lose margin t^2 / 8 there. If that is more than
// `depth` for four rings, returns more rings.
std::vector<Ring> rings_of_cylinder(int points, double margin, double depth) {
  constexpr double side = 0.46, end = 1.57;  // rad
  constexpr int max_rings = 6;               // towards each end
  const auto loss = [margin](double spacing) { return margin * spacing * spacing / 8; };
  if (!(loss(end - side) > depth))
    return {{-end, points}, {-side, points}, {side, points}, {end, points}};
  const auto spacing = [](int count) { return end / (count - 0.5); };
  int count = 3;
  while (count < max_rings && loss(spacing(count)) > depth) ++count;
  std::vector<Ring> rings;
  for (int i = -count; i < count; ++i) rings.push_back({(i + 0.5) * spacing(count), points});
  return rings;
}

// Number of points of a circle. A polygon lies at most (pi / points)^2 / 2 of the radius inside its
// circle. The number is a multiple of four, so that the polygon reaches as far along each axis as
// the circle.
int points_of_circle(double radius, double depth) {
  constexpr int min_quarter = 3, max_quarter = 12;
  const double quarter_count = pi / 4 * std::sqrt(0.5 * radius / depth);
  return 4 * (quarter_count < max_quarter
                  ? std::max(min_quarter, static_cast<int>(std::lround(quarter_count)))
                  : max_quarter);
}

btVector3 half_sides(const btConvexShape& shape) {
  btVector3 lower, upper;
  shape.getAabb(btTransform::getIdentity(), lower, upper);
  return (upper - lower) / 2;
}

// Returns the directions in which the support points of a round shape are sampled.
std::vector<btVector3> directions(const btConvexShape& shape, double depth) {
  const btVector3 half = half_sides(shape);
  const auto radius_about = [&](int axis) { return static_cast<double>(half[(axis + 1) % 3]); };
  const auto of_cylinder = [&](int axis) {
    const double radius = radius_about(axis), min_depth = 0.005 * radius;
    return directions_in(
        rings_of_cylinder(points_of_circle(radius, depth), static_cast<double>(shape.getMargin()),
                          std::max(depth, min_depth)),
        axis);
  };
  switch (shape.getShapeType()) {
    case CAPSULE_SHAPE_PROXYTYPE: {
      const int axis = static_cast<const btCapsuleShape&>(shape).getUpAxis();
      return directions_in(rings_of_capsule(ring_count(radius_about(axis), depth)), axis);
    }
    case CYLINDER_SHAPE_PROXYTYPE:
      return of_cylinder(static_cast<const btCylinderShape&>(shape).getUpAxis());
    case CONE_SHAPE_PROXYTYPE:
      return of_cylinder(static_cast<const btConeShape&>(shape).getConeUpIndex());
    default: {  // spheres, and other shapes as if they were spheres
      const auto radius = static_cast<double>(half[half.maxAxis()]);
      return directions_in(rings_of_ball(ring_count(radius, depth)), 1);
    }
  }
}

// Returns the points whose convex hull stands for the shape.
std::vector<btVector3> surface_points(const btConvexShape& shape, double depth) {
  std::vector<btVector3> points;
  if (shape.isPolyhedral()) {
    const auto& polyhedron = static_cast<const btPolyhedralConvexShape&>(shape);
    for (int i = 0; i < polyhedron.getNumVertices(); ++i) {
      points.emplace_back();
      polyhedron.getVertex(i, points.back());
    }
  } else if (shape.getShapeType() == UNIFORM_SCALING_SHAPE_PROXYTYPE) {
    const auto& scaled = static_cast<const btUniformScalingShape&>(shape);
    const btScalar factor = scaled.getUniformScalingFactor();
    points = surface_points(*scaled.getChildShape(), depth / static_cast<double>(factor));
    for (btVector3& p : points) p *= factor;
  } else {
    points = directions(shape, depth);
    for (btVector3& p : points) p = shape.localGetSupportingVertex(p);
  }
  return points;
}

bool add_convex(const btConvexShape& shape, const btTransform& pose, double depth,
                Triangles& triangles) {
  const std::vector<btVector3> points = surface_points(shape, depth);
  if (points.size() < 4) return false;
  btConvexHullComputer hull;
  hull.compute(&points[0].getX(), sizeof(btVector3), static_cast<int>(points.size()), 0, 0);
  const auto first = static_cast<std::int32_t>(triangles.vertices.size());
  for (int i = 0; i < hull.vertices.size(); ++i) {
    // The given points are exact; the coordinates that the hull computes are rounded.
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

AxisBox AxisBox::transformed(const btTransform& pose) const {
  AxisBox result;
  btTransformAabb(lower, upper, 0, pose, result.lower, result.upper);
  return result;
}

bool tessellate(const btCollisionShape& shape, const btTransform& pose, const AxisBox& region,
                const AxisBox& near, double depth, Triangles& triangles) {
  if (shape.isCompound()) {
    const auto& compound = static_cast<const btCompoundShape&>(shape);
    bool is_complete = true;
    for (int i = 0; i < compound.getNumChildShapes(); ++i) {
      is_complete &= tessellate(*compound.getChildShape(i), pose * compound.getChildTransform(i),
                                region, near, depth, triangles);
    }
    return is_complete;
  }
  if (shape.isConvex())
    return add_convex(static_cast<const btConvexShape&>(shape), pose, depth, triangles);
  if (!has_triangles(shape)) return false;
  Welder welder(pose, triangles);
  const AxisBox local = region.transformed(pose.inverse());
  if (shape.getShapeType() == STATIC_PLANE_PROXYTYPE) {
    process_plane(static_cast<const btStaticPlaneShape&>(shape),
                  near.is_empty() ? near : near.transformed(pose.inverse()), local, welder);
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
