// Finds which of many unit vectors point nearly in a given direction.
#pragma once

#include <LinearMath/btVector3.h>

#include <cstdint>
#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/span.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Cells on the faces of a cube around the origin. Each cell lists the vectors that may be near a
/// direction through it.
class DirectionGrid {
 public:
  DirectionGrid() = default;
  /// near() will list all of `vectors` (unit length) whose cosine with the direction is at least
  /// `min_cosine`.
  DirectionGrid(const std::vector<btVector3>& vectors, double min_cosine);

  /// Indices of vectors, ascending. Contains every vector that near() must list, and a few others.
  /// `direction` is not zero.
  Span<const std::int32_t> near(const btVector3& direction) const;
  /// Indices of all vectors.
  Span<const std::int32_t> all() const { return all_; }

 private:
  static constexpr int cells_per_side = 8;
  static constexpr int cell_count = 6 * cells_per_side * cells_per_side;

  std::vector<std::int32_t> first_;    // by cell: of its part of indices_; and a last one
  std::vector<std::int32_t> indices_;  // by cell
  std::vector<std::int32_t> all_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
