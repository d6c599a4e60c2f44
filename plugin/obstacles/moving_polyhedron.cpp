#include "obstacles/moving_polyhedron.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

#include "motion/closest_points.h"
#include "settings.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using SideValues =
    Eigen::Array<double, Eigen::Dynamic, 1, 0, static_cast<int>(ConvexPart::max_sides), 1>;
using SideView = Eigen::Map<const Eigen::ArrayXd>;
using VertexValues =
    Eigen::Array<double, Eigen::Dynamic, 1, 0, static_cast<int>(ConvexPart::max_vertices), 1>;
// One point a row.
using PointView = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 3>>;

constexpr double infinity = std::numeric_limits<double>::infinity();

PointView rows_of(const std::vector<double>& coordinates) {
  return {coordinates.data(), static_cast<Eigen::Index>(coordinates.size() / 3), 3};
}
Vector3d point_of(const PointView& points, Eigen::Index i) {
  return {points(i, 0), points(i, 1), points(i, 2)};
}

void set_point(std::vector<double>& coordinates, std::size_t i, const Vector3d& x) {
  const std::size_t count = coordinates.size() / 3;
  for (std::size_t k = 0; k < 3; ++k) coordinates[k * count + i] = x[static_cast<int>(k)];
}

// How far points are along a direction, metres.
class Places {
 public:
  // `coordinates`: as of MovingPolyhedron; they must outlive this object.
  Places(const std::vector<double>& coordinates, const Vector3d& direction)
      : count_(coordinates.size() / 3), x_(coordinates.data()), direction_(direction) {}
  std::size_t count() const { return count_; }
  double operator[](std::size_t i) const {
    return x_[i] * direction_[0] + x_[count_ + i] * direction_[1] +
           x_[2 * count_ + i] * direction_[2];
  }

 private:
  std::size_t count_;
  const double* x_;
  Vector3d direction_;
};

// How far vertices are along a direction at time t, metres.
VertexValues places_along(const std::vector<double>& start, const std::vector<double>& end,
                          const Vector3d& direction, double t) {
  const Places at_start(start, direction), at_end(end, direction);
  VertexValues places(static_cast<Eigen::Index>(at_start.count()));
  for (std::size_t i = 0; i < at_start.count(); ++i)
    places[static_cast<Eigen::Index>(i)] = t == 0   ? at_start[i]
                                           : t == 1 ? at_end[i]
                                                    : (1 - t) * at_start[i] + t * at_end[i];
  return places;
}

SideValues heights_at(const VertexHeights& vertex, std::int32_t sides, double t) {
  return (1 - t) * SideView(vertex.start, sides) + t * SideView(vertex.end, sides);
}

}  // namespace

void MovingPolyhedron::move(const RigidMotion& rigid, const Motion& motion, bool at_start) {
  const auto count = static_cast<std::size_t>(part_->vertex_end - part_->first_vertex),
             sides = static_cast<std::size_t>(side_count());
  start_.resize(3 * count);
  end_.resize(3 * count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::int32_t v = rigid.first_vertex + part_->first_vertex + static_cast<std::int32_t>(i);
    set_point(start_, i, motion.start_of(v));
    set_point(end_, i, at_start ? motion.start_of(v) : motion.end_of(v));
  }
  const PointView start = rows_of(start_), end = rows_of(end_);
  is_finite_ = start.allFinite() && end.allFinite();
  rounding_ = rounding * std::max(start.cwiseAbs().rowwise().sum().maxCoeff(),
                                  end.cwiseAbs().rowwise().sum().maxCoeff());
  normals_.resize(3 * sides);
  planes_.resize(sides);
  for (std::size_t s = 0; s < sides; ++s) {
    const btVector3& local = part_->sides[s].normal;
    planes_[s].normal = to_double(rigid.start.getBasis() * local).normalized();
    set_point(normals_, s, planes_[s].normal);
  }
  set_reach(start_, start_reach_);
  if (start_ == end_)
    end_reach_ = start_reach_;
  else
    set_reach(end_, end_reach_);
  for (std::size_t s = 0; s < sides; ++s) {
    planes_[s].start_reach = start_reach_[s];
    planes_[s].end_reach = end_reach_[s];
  }
}

void MovingPolyhedron::set_reach(const Coordinates& points, std::vector<double>& reach) const {
  reach.assign(static_cast<std::size_t>(side_count()), -infinity);
  const PointView rows = rows_of(points);
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    const Places along(normals_, point_of(rows, i));
    for (std::size_t s = 0; s < reach.size(); ++s) reach[s] = std::max(reach[s], along[s]);
  }
  for (double& highest : reach) highest += rounding_;
}

void MovingPolyhedron::find_heights(const Vector3d& x0, const Vector3d& x1, double* start,
                                    double* end) const {
  const auto write = [&](const Vector3d& x, const std::vector<double>& reach, double* heights) {
    const Places along(normals_, x);
    const double rounding_of_x = rounding_of(x);
    for (std::size_t s = 0; s < reach.size(); ++s) heights[s] = along[s] - reach[s] - rounding_of_x;
  };
  write(x0, start_reach_, start);
  write(x1, end_reach_, end);
}

std::int32_t MovingPolyhedron::highest_side(const VertexHeights& vertex) const {
  Eigen::Index side;
  SideView(vertex.start, side_count()).min(SideView(vertex.end, side_count())).maxCoeff(&side);
  return static_cast<std::int32_t>(side);
}

bool MovingPolyhedron::starts_outside(const VertexHeights& vertex) const {
  return SideView(vertex.start, side_count()).maxCoeff() > 0;
}

bool MovingPolyhedron::is_above_one_side(const MovingPrimitive& primitive, double height) const {
  SideValues lowest = SideValues::Constant(side_count(), infinity);
  for (int i = 0; i < primitive.start.count; ++i)
    lowest = lowest.min(SideView(primitive.heights[i].start, side_count()))
                 .min(SideView(primitive.heights[i].end, side_count()));
  return lowest.maxCoeff() >= height;
}

// The vertex enters the polyhedron, thickened by near_height, where it has passed the last side
// that it starts above (Cyrus and Beck 1978).
bool MovingPolyhedron::find_near(const VertexHeights& vertex, double near_height, double& time,
                                 std::int32_t& side) const {
  time = 0;
  double last = 1, highest = -infinity;
  for (std::int32_t s = 0; s < side_count(); ++s) {
    const double start = vertex.start[s], end = vertex.end[s];
    if (start > near_height) {
      if (end > near_height) return false;
      const double enters = (start - near_height) / (start - end);
      if (enters > time) {
        time = enters;
        side = s;
      }
    } else if (end > near_height) {
      last = std::min(last, (near_height - start) / (end - start));
    }
    if (time == 0 && start > highest) {
      highest = start;
      side = s;
    }
  }
  return time <= last;
}

// The height of a point of the edge above all sides is the largest of linear functions of its
// place. Where it is lowest, one side falls along the edge and another one rises. The sum of their
// normals that is perpendicular to the edge is the normal of the plane.
bool MovingPolyhedron::edge_plane(const VertexHeights& a, const VertexHeights& b, double t,
                                  SeparatingPlane& plane) const {
  const SideValues of_a = heights_at(a, side_count(), t), of_b = heights_at(b, side_count(), t);
  Eigen::Index falling, rising;
  of_a.maxCoeff(&falling);
  of_b.maxCoeff(&rising);
  plane.sides = {static_cast<std::int32_t>(falling), static_cast<std::int32_t>(rising)};
  if (of_b[falling] >= of_a[falling] || of_a[rising] >= of_b[rising]) {  // an end is lowest
    const Eigen::Index side = of_b[falling] >= of_a[falling] ? falling : rising;
    plane.sides.fill(static_cast<std::int32_t>(side));
    plane.normal = normal(plane.sides[0]);
    plane.height = std::min(of_a[side], of_b[side]);
    return false;
  }
  double along = 0;
  for (int i = 0; i < settings::simple_shapes::max_edge_turns; ++i) {
    const double fall = of_a[falling] - of_b[falling], rise = of_b[rising] - of_a[rising];
    along = (of_a[falling] - of_a[rising]) / (fall + rise);
    const double share = fall / (fall + rise);  // of the rising side
    plane.normal = (1 - share) * normal(static_cast<std::int32_t>(falling)) +
                   share * normal(static_cast<std::int32_t>(rising));
    plane.height = (1 - along) * of_a[falling] + along * of_b[falling];
    Eigen::Index top;
    const double height = ((1 - along) * of_a + along * of_b).maxCoeff(&top);
    if (top == falling || top == rising || !(height > plane.height)) break;
    (of_b[top] >= of_a[top] ? rising : falling) = top;
  }
  plane.sides = {static_cast<std::int32_t>(falling), static_cast<std::int32_t>(rising)};
  plane.weights = {1 - along, along, 0};
  const double length = plane.normal.norm();
  if (!(length > settings::simple_shapes::min_normal_sum)) {
    plane.height = -infinity;
    return false;
  }
  plane.normal /= length;
  plane.height /= length;
  return true;
}

// The face's own plane, with the nearest vertex of the polyhedron behind it.
bool MovingPolyhedron::face_plane(const PrimitivePoints& face, double t,
                                  SeparatingPlane& plane) const {
  const TrianglePlane triangle(face.x[0], face.x[1], face.x[2]);
  plane.height = -infinity;
  if (!triangle.exists()) return false;
  const Vector3d normal = triangle.across / std::sqrt(triangle.across_squared);
  const VertexValues places = places_along(start_, end_, normal, t);
  Eigen::Index highest, lowest;
  const double at = normal.dot(face.x[0]), over = at - places.maxCoeff(&highest),
               under = places.minCoeff(&lowest) - at;
  const bool is_over = over > under;
  const Eigen::Index nearest = is_over ? highest : lowest;
  plane.normal = is_over ? normal : -normal;
  plane.height = is_over ? over : under;
  plane.vertex = part_->first_vertex + static_cast<std::int32_t>(nearest);
  plane.weights = triangle.weights_below((1 - t) * point_of(rows_of(start_), nearest) +
                                         t * point_of(rows_of(end_), nearest));
  return is_inside(plane.weights);
}

double MovingPolyhedron::height(const PrimitivePoints& primitive, const Vector3d& normal,
                                double t) const {
  double lowest = infinity, largest = 0;
  for (int i = 0; i < primitive.count; ++i) {
    lowest = std::min(lowest, normal.dot(primitive.x[i]));
    largest = std::max(largest, primitive.x[i].norm_1());
  }
  return lowest - places_along(start_, end_, normal, t).maxCoeff() - rounding_ - rounding * largest;
}

// Conservative advancement: in a fixed direction heights are linear in time.
bool MovingPolyhedron::find_near(const MovingPrimitive& primitive, double near_height, double& time,
                                 SeparatingPlane& plane) const {
  time = 0;
  bool is_closest = find_plane(primitive, time, plane);
  for (int i = 0; i < settings::simple_shapes::max_advances && plane.height > near_height; ++i) {
    const double end_height = height(primitive.end, plane.normal, 1);
    if (end_height > near_height) return false;
    time = std::min(1.0,
                    time + (1 - time) * (plane.height - near_height) / (plane.height - end_height));
    is_closest = find_plane(primitive, time, plane);
  }
  return is_closest;
}

bool MovingPolyhedron::find_plane(const MovingPrimitive& primitive, double t,
                                  SeparatingPlane& plane) const {
  return primitive.start.count == 2
             ? edge_plane(primitive.heights[0], primitive.heights[1], t, plane)
             : face_plane(between(primitive.start, primitive.end, t), t, plane);
}

bool MovingPolyhedron::find_next(const MovingPrimitive& edge, double time,
                                 const SeparatingPlane& plane, SeparatingPlane& next) const {
  const SideValues of_a = heights_at(edge.heights[0], side_count(), time),
                   slopes = heights_at(edge.heights[1], side_count(), time) - of_a;
  const auto [falling, rising] = plane.sides;
  const bool rises = slopes[rising] < -slopes[falling];
  const std::int32_t flat = rises ? rising : falling;
  double along = rises ? 1 : 0;
  std::int32_t other = flat;
  for (std::int32_t s = 0; s < side_count(); ++s) {
    const double steeper = slopes[s] - slopes[flat];
    if (rises ? !(steeper > 0) : !(steeper < 0)) continue;
    const double meets = (of_a[flat] - of_a[s]) / steeper;
    if (rises ? !(meets < along) : !(meets > along)) continue;
    along = meets;
    other = s;
  }
  if (other == flat || along == plane.weights[1]) return false;
  next.normal = normal(flat);
  next.height = of_a[flat] + along * slopes[flat];
  next.weights = {1 - along, along, 0};
  next.sides = {flat, other};
  return true;
}

bool MovingPolyhedron::is_clear(const MovingPrimitive& primitive) const {
  return is_clear(primitive, 0, 1, settings::simple_shapes::max_halvings);
}

// By the theorem of separating axes, one of these planes is between two convex polyhedra: that of a
// side, that of the face, or one along an edge of each.
bool MovingPolyhedron::is_clear(const MovingPrimitive& primitive, double t0, double t1,
                                int halvings) const {
  const double middle = 0.5 * (t0 + t1);
  const PrimitivePoints first = between(primitive.start, primitive.end, t0),
                        last = between(primitive.start, primitive.end, t1);
  const auto separates = [&](const SeparatingPlane& plane) {
    return plane.height > 0 && height(first, plane.normal, t0) > 0 &&
           height(last, plane.normal, t1) > 0;
  };
  SeparatingPlane plane;
  bool is_clear_now = false;
  if (primitive.start.count == 3) {
    face_plane(between(primitive.start, primitive.end, middle), middle, plane);
    is_clear_now = separates(plane);
  }
  for (int i = 0; i < primitive.start.count && !is_clear_now; ++i) {
    const VertexHeights &a = primitive.heights[i],
                        &b = primitive.heights[(i + 1) % primitive.start.count];
    edge_plane(a, b, middle, plane);
    is_clear_now = separates(plane);
  }
  if (is_clear_now) return true;
  return halvings > 0 && is_clear(primitive, t0, middle, halvings - 1) &&
         is_clear(primitive, middle, t1, halvings - 1);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
