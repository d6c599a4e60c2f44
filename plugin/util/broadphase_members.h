// What is in Bullet's broad phase, and whether anything was added to it or removed.
#pragma once

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>

#include <functional>

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

/// Calls `visit` for each proxy, in no defined order. `broadphase` may be null. Of Bullet's usual
/// broad phase it reads the lists: the tree loses proxies once the bounds of one were not finite.
void for_each_proxy(btBroadphaseInterface* broadphase,
                    const std::function<void(const btBroadphaseProxy&)>& visit);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
