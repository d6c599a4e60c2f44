// Whether anything was added to Bullet's broad phase or removed from it.
#pragma once

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>

#include "lazyccd/bullet/precision.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Follows the counters of a btDbvtBroadphase, Bullet's usual broad phase.
class BroadphaseMembers {
 public:
  /// Returns whether proxies may have been added or removed since the last call. Always true for
  /// null and for other kinds of broad phase.
  bool may_have_changed(const btBroadphaseInterface* broadphase);

 private:
  const btDbvtBroadphase* tree_ = nullptr;
  int count_ = 0, last_id_ = 0, collisions_ = 0;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
