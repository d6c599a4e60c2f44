#include "shapes/direction_grid.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// The point of a face of the cube [-1, 1]^3 at (u, v). `face`: twice the axis that it faces, plus
// one for the negative direction.
btVector3 on_cube(int face, btScalar u, btScalar v) {
  const int axis = face / 2;
  btVector3 x;
  x[axis] = face % 2 == 0 ? btScalar(1) : btScalar(-1);
  x[(axis + 1) % 3] = u;
  x[(axis + 2) % 3] = v;
  return x.normalized();
}

}  // namespace

DirectionGrid::DirectionGrid(const std::vector<btVector3>& vectors, double min_cosine)
    : all_(vectors.size()) {
  std::iota(all_.begin(), all_.end(), 0);
  constexpr double spare = 1e-3;  // radians, far more than rounding
  const double max_angle = std::acos(std::clamp(min_cosine, -1.0, 1.0)) + spare;
  const double pi = std::acos(-1.0);
  const btScalar width = btScalar(2) / cells_per_side;
  first_.push_back(0);
  for (int cell = 0; cell < cell_count; ++cell) {
    const int face = cell / (cells_per_side * cells_per_side);
    const btScalar u = -1 + width * static_cast<btScalar>(cell / cells_per_side % cells_per_side),
                   v = -1 + width * static_cast<btScalar>(cell % cells_per_side);
    const btVector3 centre = on_cube(face, u + width / 2, v + width / 2);
    btScalar nearest_corner = 1;  // cosine; of all points of a cell, a corner is farthest away
    for (const btScalar corner_u : {u, u + width})
      for (const btScalar corner_v : {v, v + width})
        nearest_corner = btMin(nearest_corner, centre.dot(on_cube(face, corner_u, corner_v)));
    const double radius = std::acos(static_cast<double>(nearest_corner));
    const double angle = max_angle + radius;
    // Below the cosine of any direction, however it is rounded, if all are near.
    const auto least = angle < pi ? static_cast<btScalar>(std::cos(angle)) : btScalar(-2);
    for (std::size_t i = 0; i < vectors.size(); ++i) {
      if (vectors[i].dot(centre) >= least) indices_.push_back(static_cast<std::int32_t>(i));
    }
    first_.push_back(static_cast<std::int32_t>(indices_.size()));
  }
}

Span<const std::int32_t> DirectionGrid::near(const btVector3& direction) const {
  const int axis = direction.absolute().maxAxis();
  const btScalar size = btFabs(direction[axis]);
  const auto index = [&](int k) {
    const btScalar at = (direction[(axis + k) % 3] / size + 1) / 2 * cells_per_side;
    return std::min(static_cast<int>(at), cells_per_side - 1);
  };
  const int face = 2 * axis + (direction[axis] < 0 ? 1 : 0);
  const auto cell =
      static_cast<std::size_t>((face * cells_per_side + index(1)) * cells_per_side + index(2));
  return {indices_.data() + first_[cell],
          static_cast<std::size_t>(first_[cell + 1] - first_[cell])};
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
