#include "obstacles/moving_core.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "motion/closest_points.h"
#include "settings.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

Vector3d transformed(const btTransform& pose, const btVector3& x) {
  const btMatrix3x3& basis = pose.getBasis();
  const Vector3d local = to_double(x);
  Vector3d world = to_double(pose.getOrigin());
  for (int k = 0; k < 3; ++k) world[k] += to_double(basis[k]).dot(local);
  return world;
}

void keep_closer(const ClosestPoints& other, ClosestPoints& closest) {
  if (other.distance < closest.distance) closest = other;
}

}  // namespace

MovingCore::MovingCore(const RoundPart& part, const RigidMotion& rigid, bool at_start)
    : start_{transformed(rigid.start, part.core[0]), transformed(rigid.start, part.core[1])},
      end_(start_) {
  if (!at_start)
    end_ = {transformed(rigid.end, part.core[0]), transformed(rigid.end, part.core[1])};
}

MotionBounds MovingCore::bounds() const {
  MotionBounds bounds;
  for (const Segment& core : {start_, end_}) {
    bounds.add(core.first);
    bounds.add(core.last);
  }
  return bounds;
}

double MovingCore::distance(const Vector3d& x, double t) const {
  const Segment core = at(t);
  const double along = place_on_segment(x, core.first, core.last);
  return (x - (core.first + along * (core.last - core.first))).norm();
}

// Of a face that the core does not pierce, the closest point is on a side, or it is below an end of
// the core.
ClosestPoints MovingCore::closest(const PrimitivePoints& primitive, double t) const {
  const Segment core = at(t);
  const Vector3d along_core = core.last - core.first;
  const auto& x = primitive.x;
  if (primitive.count == 1) {
    const double along = place_on_segment(x[0], core.first, core.last);
    const Vector3d gap = x[0] - (core.first + along * along_core);
    return {gap.norm(), along, {1, 0, 0}, gap};
  }
  ClosestPoints closest{std::numeric_limits<double>::infinity(), 0, {0, 0, 0}, Vector3d::Zero()};
  const int sides = primitive.count == 2 ? 1 : 3;
  for (int i = 0; i < sides; ++i) {
    const int j = (i + 1) % 3;
    const ClosestOnSegments side = closest_on_segments(x[i], x[j] - x[i], core.first, along_core);
    ClosestPoints points{side.gap.norm(), side.t, {0, 0, 0}, side.gap};
    points.weights[i] = 1 - side.s;
    points.weights[j] = side.s;
    keep_closer(points, closest);
  }
  if (primitive.count == 2) return closest;
  const TrianglePlane plane(x[0], x[1], x[2]);
  if (!plane.exists()) return closest;
  const double heights[] = {plane.across.dot(core.first - x[0]),
                            plane.across.dot(core.last - x[0])};
  for (int end = 0; end < 2; ++end) {
    const std::array<double, 3> weights = plane.weights_below(end == 0 ? core.first : core.last);
    if (!is_inside(weights)) continue;
    const Vector3d gap = -heights[end] / plane.across_squared * plane.across;
    keep_closer({gap.norm(), static_cast<double>(end), weights, gap}, closest);
  }
  if (heights[0] * heights[1] < 0) {
    const double along = heights[0] / (heights[0] - heights[1]);
    const std::array<double, 3> weights = plane.weights_below(core.first + along * along_core);
    if (is_inside(weights)) return {0, along, weights, Vector3d::Zero()};
  }
  return closest;
}

// Conservative advancement. The distance along a fixed direction is a concave function of time: the
// least of the primitive's vertices, less the most of the core's ends. So it is at least its chord.
bool MovingCore::find_near(const PrimitivePoints& start, const PrimitivePoints& end,
                           double near_distance, double& time, ClosestPoints& points) const {
  time = 0;
  points = closest(start, 0);
  for (int i = 0; i < settings::simple_shapes::max_advances && points.distance > near_distance;
       ++i) {
    const Vector3d normal = points.between / points.distance;
    double nearest = std::numeric_limits<double>::infinity();
    for (int k = 0; k < end.count; ++k) nearest = std::min(nearest, normal.dot(end.x[k]));
    const double at_end = nearest - std::max(normal.dot(end_.first), normal.dot(end_.last));
    if (at_end > near_distance) return false;
    time = std::min(
        1.0, time + (1 - time) * (points.distance - near_distance) / (points.distance - at_end));
    points = closest(between(start, end, time), time);
  }
  return true;
}

double MovingCore::relative_move(const Vector3d& x0, const Vector3d& x1) const {
  const Vector3d move = x1 - x0;
  return std::max((move - (end_.first - start_.first)).norm(),
                  (move - (end_.last - start_.last)).norm());
}

double MovingCore::smallest_distance(const Vector3d& x0, const Vector3d& x1) const {
  const Vector3d first = end_.first - start_.first, last = end_.last - start_.last;
  const Vector3d turn = 0.5 * (last - first), shift = 0.5 * (first + last);
  return closest_on_segments(x0, x1 - shift - x0, start_.first, start_.last - start_.first)
             .gap.norm() -
         turn.norm();
}

bool MovingCore::is_farther(double radius, const PrimitivePoints& start,
                            const PrimitivePoints& end) const {
  return is_farther(radius, start, end, 0, 1, settings::simple_shapes::max_halvings);
}

// In a fixed direction all distances from a plane are linear in time, so the ends of the time
// decide.
bool MovingCore::is_farther(double radius, const PrimitivePoints& start, const PrimitivePoints& end,
                            double t0, double t1, int halvings) const {
  const double middle = 0.5 * (t0 + t1);
  const ClosestPoints points = closest(between(start, end, middle), middle);
  if (!(points.distance > radius)) return false;
  const Vector3d normal = points.between / points.distance;
  const auto separates = [&](double t) {
    const PrimitivePoints primitive = between(start, end, t);
    const Segment core = at(t);
    double nearest = std::numeric_limits<double>::infinity();
    for (int i = 0; i < primitive.count; ++i)
      nearest = std::min(nearest, normal.dot(primitive.x[i]));
    return nearest - std::max(normal.dot(core.first), normal.dot(core.last)) > radius;
  };
  if (separates(t0) && separates(t1)) return true;
  return halvings > 0 && is_farther(radius, start, end, t0, middle, halvings - 1) &&
         is_farther(radius, start, end, middle, t1, halvings - 1);
}

double MovingCore::rounding(double radius) const {
  constexpr double count = 64;  // of roundings
  double largest = radius;
  for (const Vector3d* x : {&start_.first, &start_.last, &end_.first, &end_.last})
    largest = std::max(largest, x->norm_infinity() + radius);
  return count * static_cast<double>(std::numeric_limits<btScalar>::epsilon()) * largest;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
