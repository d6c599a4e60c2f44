// Faces in the cells of a grid in the plane across an axis.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "untangling/face_geometry.h"
#include "util/box.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class FaceGrid {
 public:
  using Box = Box2d;

  /// `axis`: unit vector. `faces`: ascending. `region`: faces whose boxes across the axis do not
  /// meet it are left out. `geometry` must outlive the grid.
  FaceGrid(const FaceGeometry& geometry, const Vector3d& axis,
           const std::vector<std::int32_t>& faces, const Box& region);
  /// The same with all of the faces.
  FaceGrid(const FaceGeometry& geometry, const Vector3d& axis,
           const std::vector<std::int32_t>& faces)
      : FaceGrid(geometry, axis, faces,
                 Box(Vector2d::Constant(-max_coordinate), Vector2d::Constant(max_coordinate))) {}

  /// All faces that the line through x along the axis may meet, ascending, and others near it.
  Span<const std::int32_t> near(const Vector3d& x) const;
  /// How often the faces wind around x, if they are closed and oriented alike.
  int winding_number(const Vector3d& x) const;
  /// The face nearest to x, as the point on it; of those that are equally near, the first. Leaves
  /// out faces that are not farther away than the rounding of positions. Face -1 if there is none.
  struct Nearest {
    std::int32_t face;
    Vector3d point;
  };
  Nearest nearest(const Vector3d& x) const;
  /// Coordinates of x in the plane.
  Vector2d across(const Vector3d& x) const { return (turn_ * x).head<2>(); }

  /// The same without a grid.
  static Vector2d across(const Vector3d& axis, const Vector3d& x) {
    return (turn_to(axis) * x).head<2>();
  }

 private:
  static constexpr double max_coordinate = 1e300;  // as good as infinite, at no cost
  using Cell = std::array<int, 2>;

  // The rotation that turns the axis to z.
  static Matrix3d turn_to(const Vector3d& axis);
  Box box_of(std::int32_t face) const;
  Cell cell_of(const Vector2d& p) const;
  Span<const std::int32_t> in_cell(const Cell& cell) const;
  template <class Visit>
  void visit_cells(const Box& box, Visit&& visit) const;

  const FaceGeometry& geometry_;
  Matrix3d turn_;
  Vector2d lower_ = Vector2d::Zero();
  double cells_per_metre_ = 0;
  Cell size_ = {1, 1};
  std::vector<std::size_t> first_;  // by cell: index in faces_; one more element ends the last cell
  std::vector<std::int32_t> faces_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
