// The poses of a world's rigid bodies at the start and at the end of a step.
//
// A static or kinematic body moves from its pose at the end of the last step to its pose now. A
// dynamic body moves from its pose before Bullet integrated it. If a body closes in on something
// that cannot move, its pose here is held at the start of the step. In later steps it catches up
// with Bullet's pose: per step it moves twice as far as Bullet's body, or a tenth of its lag if
// that is more.
#pragma once

#include <BulletCollision/BroadphaseCollision/btBroadphaseInterface.h>
#include <BulletCollision/CollisionDispatch/btCollisionObject.h>

#include <unordered_map>
#include <vector>

#include "lazyccd/bullet/precision.h"
#include "util/warning_log.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// True for the kinds of object that soft bodies collide with: collision objects, rigid bodies and
/// links of multibodies.
bool is_rigid(const btCollisionObject& object);
bool is_dynamic(const btCollisionObject& object);

/// One rigid body and its motion over the step.
struct RigidPose {
  btCollisionObject* object;
  int unique_id;  ///< of its broad phase proxy; tells new objects from old ones at the same address
  btTransform start, end;   ///< poses at both ends of the step
  btTransform bullet_pose;  ///< Bullet's pose at the end of the step; `end` may lag behind it
  bool finite = true;       ///< false: pose or velocity is not finite, and the body is left out
};

class RigidPoses {
 public:
  /// Call begin_step() before Bullet moves anything and end_step() when it has. `broadphase` may be
  /// null: there are no rigid bodies then.
  void begin_step(btBroadphaseInterface* broadphase);
  void end_step(btBroadphaseInterface* broadphase, WarningLog& warnings);
  /// Holds a static or kinematic body at the start of this step. The next step sweeps it from
  /// there.
  void hold_at_start(const btCollisionObject& object);

  /// Sorted by unique_id, because the broad phase has no defined order.
  const std::vector<RigidPose>& all() const { return poses_; }

 private:
  using Objects = std::vector<btCollisionObject*>;

  void find(btBroadphaseInterface* broadphase);
  bool are_known(const Objects& objects) const;
  void update_objects(const Objects& objects);

  std::vector<RigidPose> poses_;
  std::unordered_map<int, const btCollisionObject*> known_;  // by id
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
