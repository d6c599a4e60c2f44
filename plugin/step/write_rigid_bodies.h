// Writes the motion of rigid bodies after the response to Bullet.
#pragma once

#include "motion/motion.h"
#include "scene/step_topology.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Writes poses and velocities of the dynamic bodies that the response changed, and wakes them. Of
/// multibodies the response has set the poses already.
void write_rigid_bodies(const StepTopology& topology, const Motion& motion);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
