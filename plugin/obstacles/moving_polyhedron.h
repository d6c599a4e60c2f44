// A convex polyhedron or a plane over a motion: how high vertices, edges and faces are above it.
//
// The height of a point above a side is its distance from the plane of the side, positive outside.
// Sides keep the normals that they have at the start. All vertices move in straight lines. So in a
// fixed direction the polyhedron reaches at most (1 - t) o0 + t o1 at time t, with what its
// vertices reach at both ends of the motion. Heights above that are linear in time, and lower
// bounds of the true ones. This holds in any direction: a rounded normal, or one of a body that
// turns, makes them smaller, never wrong.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "motion/motion.h"
#include "motion/primitive_points.h"
#include "shapes/convex_part.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Heights of a vertex, by side, metres: lower bounds, in spite of rounding.
struct VertexHeights {
  const double *start, *end;  ///< at both ends of the motion
};

/// An edge or a face in a motion, and the heights of its vertices.
struct MovingPrimitive {
  PrimitivePoints start, end;
  std::array<VertexHeights, 3> heights;
};

/// A plane between a polyhedron and an edge or a face, and what is closest there.
struct SeparatingPlane {
  Vector3d normal;                    ///< unit length, towards the primitive
  double height;                      ///< of the primitive above the polyhedron, metres
  std::array<double, 3> weights;      ///< the closest point of the primitive, by vertex
  std::array<std::int32_t, 2> sides;  ///< below an edge: those whose normals add up to this one
  std::int32_t vertex;                ///< below a face: the closest one of Triangles::vertices
};

class MovingPolyhedron {
 public:
  /// `part` must outlive it. Call move() before anything else.
  explicit MovingPolyhedron(const ConvexPart& part) : part_(&part) {}

  /// Sets the motion to its present end; `at_start`: the part stays where it starts.
  void move(const RigidMotion& rigid, const Motion& motion, bool at_start);

  const ConvexPart& part() const { return *part_; }
  /// False if a vertex is not finite. Then heights mean nothing.
  bool is_finite() const { return is_finite_; }
  std::int32_t side_count() const { return static_cast<std::int32_t>(part_->sides.size()); }
  const Vector3d& normal(std::int32_t side) const {
    return planes_[static_cast<std::size_t>(side)].normal;
  }
  /// Height of a vertex above one side: the lower one of start and end.
  double height_above(std::int32_t side, const Vector3d& x0, const Vector3d& x1) const {
    const SidePlane& plane = planes_[static_cast<std::size_t>(side)];
    return std::min(plane.normal.dot(x0) - rounding_of(x0) - plane.start_reach,
                    plane.normal.dot(x1) - rounding_of(x1) - plane.end_reach);
  }
  /// Writes the heights of a vertex above all sides, at the start and at the end.
  void find_heights(const Vector3d& x0, const Vector3d& x1, double* start, double* end) const;

  /// The side above which a vertex is highest in all of the motion.
  std::int32_t highest_side(const VertexHeights& vertex) const;
  /// True if a vertex starts outside.
  bool starts_outside(const VertexHeights& vertex) const;
  /// True if an edge or a face is at least `height` above some side in all of the motion.
  bool is_above_one_side(const MovingPrimitive& primitive, double height) const;

  /// Finds when a vertex first comes within `near_height`, metres, of all sides, and above which
  /// side that is. False if it never does.
  bool find_near(const VertexHeights& vertex, double near_height, double& time,
                 std::int32_t& side) const;
  /// The same for an edge or a face, and the plane below it then. False also if a part of the
  /// primitive is closest: an end of the edge, or an edge of the face. `near_height` is positive.
  bool find_near(const MovingPrimitive& primitive, double near_height, double& time,
                 SeparatingPlane& plane) const;
  /// After find_near() of an edge: the other end of the flatter side of both, where the next side
  /// begins. An edge that lies along a narrow side may come down there instead. The plane is that
  /// of the flatter side. False if that side goes on to an end of the edge.
  bool find_next(const MovingPrimitive& edge, double time, const SeparatingPlane& plane,
                 SeparatingPlane& next) const;
  /// True if it is certain that an edge or a face does not touch in the whole motion.
  bool is_clear(const MovingPrimitive& primitive) const;

 private:
  /// All x, then all y, then all z.
  using Coordinates = std::vector<double>;
  /// A side: the same as an element of normals_, start_reach_ and end_reach_.
  struct SidePlane {
    Vector3d normal;
    double start_reach, end_reach;
  };

  /// Relative to the coordinates: more than the rounding of a dot product.
  static constexpr double rounding = 0x1p-48;
  static double rounding_of(const Vector3d& x) { return rounding * x.norm_1(); }

  void set_reach(const Coordinates& points, std::vector<double>& reach) const;
  /// These find the plane at time t. They return false if a part of the primitive is closest; then
  /// some plane that may be between both is set.
  bool find_plane(const MovingPrimitive& primitive, double t, SeparatingPlane& plane) const;
  bool edge_plane(const VertexHeights& a, const VertexHeights& b, double t,
                  SeparatingPlane& plane) const;
  bool face_plane(const PrimitivePoints& face, double t, SeparatingPlane& plane) const;
  /// Lower bound of the height of a primitive along a direction, at time t.
  double height(const PrimitivePoints& primitive, const Vector3d& normal, double t) const;
  bool is_clear(const MovingPrimitive& primitive, double t0, double t1, int halvings) const;

  const ConvexPart* part_;
  Coordinates start_, end_;                      // vertices, metres
  Coordinates normals_;                          // of the sides, unit length
  std::vector<double> start_reach_, end_reach_;  // of the sides, metres
  bool is_finite_ = false;
  std::vector<SidePlane> planes_;
  double rounding_ = 0;  // of a height, metres
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
