// Damping that brings soft bodies in contact to rest.
#pragma once

#include <vector>

#include "contact/contact_row.h"
#include "motion/motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

// Soft bodies in loaded contact lose the velocity of their deformation at `rate` 1/s, the faster
// the further its root mean square is below `rest_speed` m/s. What moves as a rigid body goes on,
// so both momenta are kept, and what slides, falls or swings as a whole is not slowed. Mueller et
// al. 2007, "Position based dynamics", section 3.5. Without it cloth in contact trembles for long:
// the load wanders between neighbouring contacts, and Bullet's links answer it.
void damp_deformation(const std::vector<const ContactRow*>& rows, double rate, double rest_speed,
                      Motion& motion);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
