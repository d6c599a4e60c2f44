// Draws what a step did through Bullet's debug drawer.
#pragma once

#include <LinearMath/btIDebugDraw.h>

#include <vector>

#include "lazyccd/bullet/debug_draw.h"
#include "lazyccd/bullet/report.h"
#include "motion/motion.h"
#include "response/response.h"
#include "scene/step_topology.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Draws a finished step. `response`: null if it did not run. Reads no object of Bullet: bodies may
/// have been deleted since.
void debug_draw(const std::vector<StepContact>& contacts, const StepTopology& topology,
                const Motion& motion, Response* response, const DebugDrawOptions& options,
                btIDebugDraw& drawer);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
