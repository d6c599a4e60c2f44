// The regions of the world in which obstacles are read: boxes around groups of soft bodies.
//
// A region is larger than its bodies need, so that they stay in it for some steps. Bodies far apart
// have regions of their own. Otherwise one that leaves the world would stretch the region of all
// others.
#pragma once

#include <vector>

#include "shapes/axis_box.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// The box grown on each side by a quarter of its size along that axis plus a quarter of its
/// longest side.
AxisBox enlarged(const AxisBox& box);
/// Bounds of those boxes that overlap `box`.
AxisBox bounds_of_overlapping(Span<const AxisBox> boxes, const AxisBox& box);

class ReadRegions {
 public:
  /// Changes the regions so that each of `needed` lies in one. Returns true if one was replaced
  /// that was far larger than what is needed of it.
  bool update(Span<const AxisBox> needed);
  bool contain(Span<const AxisBox> needed) const;
  const std::vector<AxisBox>& boxes() const { return boxes_; }

 private:
  // True if no region has to change. Sets needed_.
  bool suffice(Span<const AxisBox> needed);

  std::vector<AxisBox> boxes_;
  std::vector<AxisBox> needed_;  // of each region: what lies in it
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
