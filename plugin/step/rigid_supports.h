// Which rigid bodies support the dynamic bodies of a step, by Bullet's contacts between them.
#pragma once

#include <BulletCollision/BroadphaseCollision/btDispatcher.h>

#include "motion/motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Sets RigidMotion::supports of all bodies from the contacts that Bullet has solved in this
/// step. A body is supported by static and kinematic bodies, and by those that are fewer contacts
/// away from them than it is: by the box below it in a stack, and not by the one above.
void find_supports(btDispatcher& dispatcher, Motion& motion);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
