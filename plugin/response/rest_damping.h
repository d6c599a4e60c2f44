// Damping that brings soft bodies in contact to rest.
#pragma once

#include <vector>

#include "contact/contact_row.h"
#include "lazyccd/threads.h"
#include "motion/motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Damps the deformation velocity of soft bodies whose contacts carry a load. `rate`: 1/s. The
/// damping gets stronger the further the root mean square of that velocity is below `rest_speed`
/// (m/s), and is off above it. The rigid part of the motion is kept, so linear and angular momentum
/// are conserved, and a body that slides, falls or swings as a whole is not slowed; Mueller et al.
/// 2007, "Position based dynamics", section 3.5. It is in proportion to the part of the load whose
/// contacts do not slide: a rope that slips round a pole is not on its way to rest. Without the
/// damping, cloth in contact trembles for a long time: the load wanders between neighbouring
/// contacts, and Bullet's links react to it.
void damp_deformation(const std::vector<const ContactRow*>& rows, double rate, double rest_speed,
                      const Threads& threads, Motion& motion);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
