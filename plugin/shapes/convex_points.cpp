#include "shapes/convex_points.h"

#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btConeShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btPolyhedralConvexShape.h>
#include <BulletCollision/CollisionShapes/btUniformScalingShape.h>

#include <algorithm>
#include <cmath>

#include "settings.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

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
// their points lies at most ball_depth_factor / count^2 of the radius inside the ball.
std::vector<Ring> rings_of_ball(int count) {
  const double step = pi / 2 / count, spacing = settings::shapes::ball_point_spacing * step;
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
  const double count = std::sqrt(settings::shapes::ball_depth_factor * radius / depth);
  return count < settings::shapes::max_ball_rings
             ? std::max(settings::shapes::min_ball_rings, static_cast<int>(std::lround(count)))
             : settings::shapes::max_ball_rings;
}

// Like rings_of_ball(), but with two equators, one for each end of the capsule's cylinder.
std::vector<Ring> rings_of_capsule(int count) {
  std::vector<Ring> rings = rings_of_ball(count);
  Ring& equator = rings[static_cast<std::size_t>(count)];
  equator.latitude = -settings::shapes::capsule_equator;
  Ring other = equator;
  other.latitude = settings::shapes::capsule_equator;
  rings.push_back(other);
  return rings;
}

// Returns rings for a cylinder or cone: two for its side and two for its ends. Bullet rounds the
// rims by the margin; rings at a spacing of t rad lose margin t^2 / 8 there. If that is more than
// `depth` for four rings, returns more rings.
std::vector<Ring> rings_of_cylinder(int points, double margin, double depth) {
  constexpr double side = settings::shapes::cylinder_side, end = settings::shapes::cylinder_end;
  const auto loss = [margin](double spacing) { return margin * spacing * spacing / 8; };
  if (!(loss(end - side) > depth))
    return {{-end, points}, {-side, points}, {side, points}, {end, points}};
  const auto spacing = [](int count) { return end / (count - 0.5); };
  int count = settings::shapes::min_rim_rings;
  while (count < settings::shapes::max_rim_rings && loss(spacing(count)) > depth) ++count;
  std::vector<Ring> rings;
  for (int i = -count; i < count; ++i) rings.push_back({(i + 0.5) * spacing(count), points});
  return rings;
}

// Number of points of a circle. A polygon lies at most (pi / points)^2 / 2 of the radius inside its
// circle. The number is a multiple of four, so that the polygon reaches as far along each axis as
// the circle.
int points_of_circle(double radius, double depth) {
  const double quarter_count = pi / 4 * std::sqrt(0.5 * radius / depth);
  return 4 * (quarter_count < settings::shapes::max_quarter_points
                  ? std::max(settings::shapes::min_quarter_points,
                             static_cast<int>(std::lround(quarter_count)))
                  : settings::shapes::max_quarter_points);
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
    const double radius = radius_about(axis), min_depth = settings::shapes::min_rim_depth * radius;
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

}  // namespace

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

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
