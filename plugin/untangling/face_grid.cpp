#include "untangling/face_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "shapes/line_crossing.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

namespace {

// A unit vector across `axis`, with the bits of Eigen's unitOrthogonal().
Vector3d orthogonal_to(const Vector3d& axis) {
  constexpr double negligible = 1e-12;  // rounding
  const double x = axis.x(), y = axis.y(), z = axis.z(), small = negligible * std::abs(z);
  if (std::abs(x) <= small && std::abs(y) <= small) {
    const double scale = 1 / std::sqrt(y * y + z * z);
    return {0, -z * scale, y * scale};
  }
  const double scale = 1 / std::sqrt(x * x + y * y);
  return {-y * scale, x * scale, 0};
}

}  // namespace

FaceGrid::FaceGrid(const FaceGeometry& geometry, const Vector3d& axis,
                   const std::vector<std::int32_t>& faces, const Box& region)
    : geometry_(geometry), turn_(turn_to(axis)) {
  std::vector<std::int32_t> kept;
  std::vector<Box> boxes;
  Box bounds;
  double squares = 0;
  for (const std::int32_t f : faces) {
    const Box box = box_of(f);
    if (!box.intersects(region)) continue;
    kept.push_back(f);
    boxes.push_back(box);
    bounds.extend(box);
    squares += box.diagonal().squaredNorm();
  }
  first_.assign(2, 0);
  if (kept.empty()) return;
  // Cells as large as the faces, and no more of them than faces.
  const double count = static_cast<double>(kept.size());
  const Vector2d extent = bounds.diagonal();
  double side = std::max(std::sqrt(squares / count), extent.maxCoeff() / std::sqrt(count));
  if (!(side > 0 && std::isfinite(side))) side = 1;
  lower_ = bounds.min();
  cells_per_metre_ = 1 / side;
  for (int k = 0; k < 2; ++k) size_[k] = 1 + static_cast<int>(extent[k] * cells_per_metre_);
  first_.assign(static_cast<std::size_t>(size_[0]) * static_cast<std::size_t>(size_[1]) + 1, 0);
  for (const Box& box : boxes) visit_cells(box, [&](std::size_t cell) { ++first_[cell + 1]; });
  for (std::size_t cell = 1; cell < first_.size(); ++cell) first_[cell] += first_[cell - 1];
  faces_.resize(first_.back());
  std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
  for (std::size_t i = 0; i < kept.size(); ++i)
    visit_cells(boxes[i], [&](std::size_t cell) { faces_[next[cell]++] = kept[i]; });
}

Matrix3d FaceGrid::turn_to(const Vector3d& axis) {
  Matrix3d turn;
  const Vector3d first = orthogonal_to(axis);
  turn.set_row(0, first.transpose());
  turn.set_row(1, axis.cross(first).transpose());
  turn.set_row(2, axis.transpose());
  return turn;
}

// A little larger than the face, because of rounding.
FaceGrid::Box FaceGrid::box_of(std::int32_t face) const {
  Box box;
  double spare = 0;
  for (int k = 0; k < 3; ++k) {
    const Vector3d x = geometry_.corner(face, k);
    box.extend(across(x));
    spare = std::max(spare, rounding_at(x));
  }
  return Box(box.min() - Vector2d::Constant(spare), box.max() + Vector2d::Constant(spare));
}

FaceGrid::Cell FaceGrid::cell_of(const Vector2d& p) const {
  Cell cell;
  for (int k = 0; k < 2; ++k) {
    const double at = (p[k] - lower_[k]) * cells_per_metre_;
    cell[k] = static_cast<int>(std::clamp(at, 0.0, static_cast<double>(size_[k] - 1)));
  }
  return cell;
}

Span<const std::int32_t> FaceGrid::in_cell(const Cell& cell) const {
  const std::size_t i = static_cast<std::size_t>(cell[0]) +
                        static_cast<std::size_t>(size_[0]) * static_cast<std::size_t>(cell[1]);
  return {faces_.data() + first_[i], first_[i + 1] - first_[i]};
}

template <class Visit>
void FaceGrid::visit_cells(const Box& box, Visit&& visit) const {
  const Cell first = cell_of(box.min()), last = cell_of(box.max());
  for (int j = first[1]; j <= last[1]; ++j) {
    for (int i = first[0]; i <= last[0]; ++i)
      visit(static_cast<std::size_t>(i) +
            static_cast<std::size_t>(size_[0]) * static_cast<std::size_t>(j));
  }
}

Span<const std::int32_t> FaceGrid::near(const Vector3d& x) const {
  return in_cell(cell_of(across(x)));
}

int FaceGrid::winding_number(const Vector3d& x) const {
  const Vector3d p = turn_ * x;
  int winding = 0;
  for (const std::int32_t f : near(x)) {
    const LineCrossing crossing =
        line_crossing(p, turn_ * geometry_.corner(f, 0), turn_ * geometry_.corner(f, 1),
                      turn_ * geometry_.corner(f, 2));
    if (crossing.z > p[2]) winding += crossing.sign;
  }
  return winding;
}

FaceGrid::Nearest FaceGrid::nearest(const Vector3d& x) const {
  Nearest best = {-1, Vector3d::Zero()};
  double shortest = std::numeric_limits<double>::infinity();
  const auto look_at = [&](const Cell& cell) {
    for (const std::int32_t f : in_cell(cell)) {
      if (geometry_.is_degenerate(f)) continue;
      const Vector3d point = geometry_.closest_point(f, x);
      const double distance = (point - x).norm();
      if (distance <= rounding_at(x) || !(distance <= shortest)) continue;
      if (distance == shortest && f >= best.face) continue;
      shortest = distance;
      best = {f, point};
    }
  };
  const Cell centre = cell_of(across(x));
  const int rings = std::max(size_[0], size_[1]);
  // Faces outside of the ring are at least `ring` cells away.
  for (int ring = 0; ring < rings && shortest * cells_per_metre_ >= ring - 1; ++ring) {
    for (int j = std::max(0, centre[1] - ring); j <= std::min(size_[1] - 1, centre[1] + ring);
         ++j) {
      const bool is_row = std::abs(j - centre[1]) == ring;
      for (int i = centre[0] - ring; i <= centre[0] + ring; i += is_row || ring == 0 ? 1 : 2 * ring)
        if (i >= 0 && i < size_[0]) look_at({i, j});
    }
  }
  return best;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
