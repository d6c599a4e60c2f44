#include "shapes/axis_box.h"

#include <LinearMath/btAabbUtil2.h>

#include <algorithm>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

bool AxisBox::contains(const AxisBox& b) const {
  for (int k = 0; k < 3; ++k) {
    if (b.lower[k] < lower[k] || b.upper[k] > upper[k]) return false;
  }
  return true;
}

bool AxisBox::overlaps(const AxisBox& b) const {
  return TestAabbAgainstAabb2(lower, upper, b.lower, b.upper);
}

AxisBox AxisBox::transformed(const btTransform& pose) const {
  AxisBox result;
  btTransformAabb(lower, upper, 0, pose, result.lower, result.upper);
  return result;
}

bool overlaps_any(Span<const AxisBox> boxes, const AxisBox& box) {
  return std::any_of(boxes.begin(), boxes.end(),
                     [&box](const AxisBox& other) { return other.overlaps(box); });
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
