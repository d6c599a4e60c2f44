// Bullet's rules for which pairs with a soft body collide, besides filter groups and masks.
#pragma once

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>
#include <BulletSoftBody/btSoftBody.h>

#include <cstdint>

#include "lazyccd/bullet/precision.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// The application's own broad phase filter, or null. If there is one, it alone decides: groups and
/// masks do not count (btOverlappingPairCache.h, needsBroadphaseCollision).
btOverlapFilterCallback* overlap_filter(const btSoftBody& body);

/// True if CL_SS (cluster against cluster) is the only soft-soft flag that both bodies have. Such a
/// pair stays with Bullet.
bool is_cluster_pair(const btSoftBody& a, const btSoftBody& b);

/// False if only groups and masks can exclude a pair with this body.
bool has_pair_rules(btSoftBody& body);

/// Applies all rules except groups and masks, which the detector checks itself.
bool may_collide(btSoftBody& a, btSoftBody& b);
bool may_collide(btSoftBody& a, btCollisionObject& b);

/// Hash of the list of objects that a body ignores. Used to notice changes of the list.
std::uint64_t hash_of_ignored(btCollisionObject& body);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
