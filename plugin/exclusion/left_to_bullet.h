// What of a soft body stays with Bullet, faults included. status() says it once.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include "util/warning_log.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Warns of collisions between clusters, of anchors of the deformable world, and of stiffness that
/// Bullet cannot solve. `world_index`: names the body.
void warn_of_what_is_left_to_bullet(const btSoftBody& body, int world_index, WarningLog& warnings);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
