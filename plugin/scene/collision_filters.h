// Bullet's rules about which pairs with a soft body collide, beyond filter groups and masks.
#pragma once

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>
#include <BulletSoftBody/btSoftBody.h>

#include <cstdint>

#include "lazyccd/bullet/precision.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

// The application's own filter of the broad phase, or null. Where there is one, it alone decides
// and groups and masks do not count (btOverlappingPairCache.h, needsBroadphaseCollision).
btOverlapFilterCallback* overlap_filter(const btSoftBody& body);

// Both bodies ask Bullet for cluster against cluster: such a pair stays with Bullet.
bool is_cluster_pair(const btSoftBody& a, const btSoftBody& b);

// False where a body can only meet groups and masks.
bool has_pair_rules(btSoftBody& body);

// Everything but groups and masks, which the detector itself looks at.
bool may_collide(btSoftBody& a, btSoftBody& b);
bool may_collide(btSoftBody& a, btCollisionObject& b);

// Over the objects that a body ignores; changes when they do.
std::uint64_t hash_of_ignored(btCollisionObject& body);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
