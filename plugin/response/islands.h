// Islands: bodies that are connected by contacts or anchors. Static and kinematic bodies connect
// nothing.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <vector>

#include "contact/contact_row.h"
#include "motion/motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// A group of bodies that are in contact with each other, directly or through others.
struct Island {
  std::vector<std::int32_t> bodies;
  std::set<int> articulated;  ///< multibodies with a link in it, as indices in Motion::articulated
  std::set<std::int32_t> carriers;  ///< dynamic bodies that only anchors connect to it
  bool free = true;                 ///< nothing has infinite mass, locked axes, joints or supports
  /// Speed of the fastest vertex of infinite mass that was not stopped, m/s.
  double prescribed_speed = 0;

  /// Adds a body with vertices of infinite mass, of which the fastest has this speed; none: it has
  /// no such vertex.
  void add_fixed(std::optional<double> speed);
};
/// Finds the islands that these rows and the anchors make. Bodies without a contact are in none,
/// but for those in `others`.
std::vector<Island> find_islands(const std::vector<const ContactRow*>& rows,
                                 const std::vector<std::int32_t>& others, const Motion& motion);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
