// Islands: bodies that are connected by contacts or anchors.
#pragma once

#include <cstdint>
#include <vector>

#include "contact/contact_row.h"
#include "motion/motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

// Bodies that are in contact with each other, directly or through others, with what their momentum
// is made of.
struct Island {
  std::vector<std::int32_t> bodies;
  bool free = true;  // nothing of infinite mass
  double prescribed_speed = 0;  // m/s: the fastest point of what has infinite mass and was not stopped
};
std::vector<Island> find_islands(const std::vector<const ContactRow*>& rows, const Motion& motion);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
