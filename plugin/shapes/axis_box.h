// Axis-aligned boxes in Bullet's precision.
#pragma once

#include <LinearMath/btTransform.h>
#include <LinearMath/btVector3.h>

#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/span.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// An axis-aligned box.
struct AxisBox {
  btVector3 lower, upper;  ///< metres

  static AxisBox empty() {
    const btScalar far = BT_LARGE_FLOAT;
    return {btVector3(far, far, far), btVector3(-far, -far, -far)};
  }
  bool is_empty() const { return lower.x() > upper.x(); }
  void add(const btVector3& p) {
    lower.setMin(p);
    upper.setMax(p);
  }
  void add(const AxisBox& b) {
    lower.setMin(b.lower);
    upper.setMax(b.upper);
  }
  bool contains(const AxisBox& b) const;
  bool overlaps(const AxisBox& b) const;
  AxisBox expanded(const btVector3& by) const { return {lower - by, upper + by}; }
  /// The bounding box of this box moved by `pose`.
  AxisBox transformed(const btTransform& pose) const;
};

/// Whether one of `boxes` overlaps `box`.
bool overlaps_any(Span<const AxisBox> boxes, const AxisBox& box);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
