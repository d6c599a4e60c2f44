// The nodes of the binary hierarchy over the groups.
#pragma once

#include <cstdint>

#include "core/platform.h"

namespace lazyccd {

/// A node, 32 bytes. Node 0 is the root; a parent comes before its children. A leaf has left = -1 -
/// group.
struct TreeNode {
  float lo[3], hi[3];  // swept box: over both ends of the step
  std::int32_t left, right;

  LAZYCCD_HD bool leaf() const { return left < 0; }
  LAZYCCD_HD std::int32_t group() const { return -1 - left; }
};

LAZYCCD_HD inline bool overlap(const TreeNode& a, const TreeNode& b) {
  return a.lo[0] <= b.hi[0] && b.lo[0] <= a.hi[0] && a.lo[1] <= b.hi[1] && b.lo[1] <= a.hi[1] &&
         a.lo[2] <= b.hi[2] && b.lo[2] <= a.hi[2];
}

/// The sum of the sides. It decides which node of a pair to expand: the larger one.
LAZYCCD_HD inline float extent(const TreeNode& n) {
  return (n.hi[0] - n.lo[0]) + (n.hi[1] - n.lo[1]) + (n.hi[2] - n.lo[2]);
}

}  // namespace lazyccd
