// Restitution: bodies that meet fast enough bounce.
#pragma once

#include "contact/row_list.h"
#include "motion/motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

// Newton's restitution, in velocities alone: what met at `threshold` m/s or faster and was stopped
// flies apart with `restitution` times that speed in the next step, and by that nothing comes
// closer to anything else than it may. Given up to the part that keeps the kinetic energy below
// what it was.
void add_restitution(RowList& rows, double restitution, double threshold, int sweeps,
                     Motion& motion);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
