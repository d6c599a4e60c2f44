// Geometry of faces at the start of a step.
#pragma once

#include <cstdint>

#include "lazyccd/scene.h"
#include "motion/motion.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// A face that points out of the body.
struct Side {
  std::int32_t face;
  Vector3d normal;
  double offset;  ///< normal . x of its plane, metres

  double height(const Vector3d& x) const { return normal.dot(x) - offset; }
};

/// True if x is below the side by more than rounding. `origin`: of the body that the side is of.
bool is_below(const Side& side, const Vector3d& x, const Vector3d& origin);

/// Rounding of positions near x, metres.
double rounding_at(const Vector3d& x);

/// The arguments of the constructor must outlive it.
class FaceGeometry {
 public:
  FaceGeometry(const Topology& topology, const Motion& motion)
      : topology_(topology), motion_(motion) {}

  const Face& face(std::int32_t index) const { return topology_.faces[index]; }
  Vector3d corner(std::int32_t index, int k) const {
    return motion_.start_of(topology_.faces[index][k]);
  }
  /// True if the face is a line but for the rounding of positions, so that it has no normal.
  bool is_degenerate(std::int32_t index) const;
  /// `up` orients the normal if it is not zero.
  Side side_of(std::int32_t index, const Vector3d& up) const;
  /// True if the line through x along `axis` meets the face.
  bool covers(std::int32_t index, const Vector3d& axis, const Vector3d& x) const;
  Vector3d closest_point(std::int32_t index, const Vector3d& x) const;

 private:
  const Topology& topology_;
  const Motion& motion_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
