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

// A square in a plane, in the order of its corners that Bullet's own triangles have.
struct PlaneSquare {
  btVector3 centre, along, across;  // the two: of length one
  btScalar half;                    // of its side

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

// Squares around squares, the innermost about `near`.
void process_plane(const btStaticPlaneShape& plane, const AxisBox& near, const AxisBox& region,
                   btTriangleCallback& triangles) {
  constexpr btScalar ratio = 8;
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
  const btScalar enough = all.half + square.centre.distance(all.centre);
  while (square.half < enough) {
    const PlaneSquare inner = square;
    square.half *= ratio;
    for (int k = 0; k < 4; ++k) {
      add(square.corner(k), square.corner(k + 1), inner.corner(k + 1));
      add(square.corner(k), inner.corner(k + 1), inner.corner(k));
    }
  }
}

constexpr double pi = 3.14159265358979323846;

// Directions evenly about an axis, at a latitude.
struct Ring {
  double latitude;  // rad
  int points;
  double rotation = 0;  // of the first, in points
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

// Of rings between the equator and a pole. The hull of their points lies 0.7 / count^2 of the
// radius inside of a ball at most.
std::vector<Ring> rings_of_ball(int count) {
  const double step = pi / 2 / count, apart = 1.1 * step;
  std::vector<Ring> rings;
  for (int i = -count; i <= count; ++i) {
    const double around = 2 * pi * std::cos(i * step);
    rings.push_back({i * step, std::max(1, static_cast<int>(std::lround(around / apart))),
                     i % 2 == 0 ? 0.0 : 0.5});
  }
  return rings;
}

int ring_count(double radius, double depth) {
  constexpr int fewest = 4, most = 12;
  const double count = std::sqrt(0.7 * radius / depth);
  return count < most ? std::max(fewest, static_cast<int>(std::lround(count))) : most;
}

// The equator is at both ends of the capsule.
std::vector<Ring> rings_of_capsule(int count) {
  constexpr double aside = 1e-4;
  std::vector<Ring> rings = rings_of_ball(count);
  Ring& equator = rings[static_cast<std::size_t>(count)];
  equator.latitude = -aside;
  Ring other = equator;
  other.latitude = aside;
  rings.push_back(other);
  return rings;
}

// Two for the side of a cylinder or cone, two for its ends; more where `depth` is less than these
// would lose of the rims, which Bullet rounds by the margin: with rings t apart, margin t^2 / 8.
std::vector<Ring> rings_of_cylinder(int points, double margin, double depth) {
  constexpr double side = 0.46, end = 1.57;
  constexpr int most = 6;  // towards each end
  const auto lost = [margin](double apart) { return margin * apart * apart / 8; };
  if (!(lost(end - side) > depth))
    return {{-end, points}, {-side, points}, {side, points}, {end, points}};
  const auto apart = [](int count) { return end / (count - 0.5); };
  int count = 3;
  while (count < most && lost(apart(count)) > depth) ++count;
  std::vector<Ring> rings;
  for (int i = -count; i < count; ++i) rings.push_back({(i + 0.5) * apart(count), points});
  return rings;
}

// A polygon lies (pi / points)^2 / 2 of the radius inside of its circle at most. In fours: these
// reach as far along each axis as the circle.
int points_of_circle(double radius, double depth) {
  constexpr int fewest = 3, most = 12;
  const double fours = pi / 4 * std::sqrt(0.5 * radius / depth);
  return 4 * (fours < most ? std::max(fewest, static_cast<int>(std::lround(fours))) : most);
}

btVector3 half_sides(const btConvexShape& shape) {
  btVector3 lower, upper;
  shape.getAabb(btTransform::getIdentity(), lower, upper);
  return (upper - lower) / 2;
}

// In which the support points of what is round are sampled.
std::vector<btVector3> directions(const btConvexShape& shape, double depth) {
  const btVector3 half = half_sides(shape);
  const auto radius_about = [&](int axis) { return static_cast<double>(half[(axis + 1) % 3]); };
  const auto of_cylinder = [&](int axis) {
    const double radius = radius_about(axis), least = 0.005 * radius;
    return directions_in(
        rings_of_cylinder(points_of_circle(radius, depth), static_cast<double>(shape.getMargin()),
                          std::max(depth, least)),
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
    default: {  // spheres; others as if they were one
      const auto radius = static_cast<double>(half[half.maxAxis()]);
      return directions_in(rings_of_ball(ring_count(radius, depth)), 1);
    }
  }
}

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
                const AxisBox& near, double depth, Triangles& triangles) {
  if (shape.isCompound()) {
    const auto& compound = static_cast<const btCompoundShape&>(shape);
    bool whole = true;
    for (int i = 0; i < compound.getNumChildShapes(); ++i) {
      whole &= tessellate(*compound.getChildShape(i), pose * compound.getChildTransform(i), region,
                          near, depth, triangles);
    }
    return whole;
  }
  if (shape.isConvex())
    return add_convex(static_cast<const btConvexShape&>(shape), pose, depth, triangles);
  if (!has_triangles(shape)) return false;
  Welder welder(pose, triangles);
  const AxisBox local = region.placed(pose.inverse());
  if (shape.getShapeType() == STATIC_PLANE_PROXYTYPE) {
    process_plane(static_cast<const btStaticPlaneShape&>(shape),
                  near.is_empty() ? near : near.placed(pose.inverse()), local, welder);
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
