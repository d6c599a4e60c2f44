// Where the rigid bodies of a world are, and come from in a step.
//
// Static and kinematic bodies move from where the last step saw them to where they are now; dynamic
// ones from where they were before Bullet integrated them. What closes in on something that cannot
// give way is left behind where it was, and comes after Bullet's at no more than twice its speed,
// or a tenth of what it lags a step.
#pragma once

#include <BulletCollision/BroadphaseCollision/btBroadphaseInterface.h>
#include <BulletCollision/CollisionDispatch/btCollisionObject.h>

#include <unordered_map>
#include <vector>

#include "util/warning_log.h"
#include "lazyccd/bullet/precision.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

// Of the kinds that soft bodies may meet.
bool is_rigid(const btCollisionObject& object);
bool is_dynamic(const btCollisionObject& object);

struct RigidPose {
  btCollisionObject* object;
  int unique_id;  // of its broad phase proxy: says which objects are new where memory is reused
  btTransform start, end;  // of the step
  btTransform seen;        // where Bullet has it
  bool finite = true;      // it, and how it moves; false: it is to be left out
};

class RigidPoses {
 public:
  // To be called before Bullet moves anything, and where the step ends. Null: there are none.
  void begin_step(btBroadphaseInterface* broadphase);
  void end_step(btBroadphaseInterface* broadphase, WarningLog& warnings);
  // The next step sweeps this one, which nothing moves, from where this step began.
  void leave_behind(const btCollisionObject& object);

  // Sorted by id, for the broad phase has no order of its own.
  const std::vector<RigidPose>& all() const { return poses_; }

 private:
  using Objects = std::vector<btCollisionObject*>;

  void find(btBroadphaseInterface* broadphase);
  bool are_known(const Objects& objects) const;
  void take(const Objects& objects);

  std::vector<RigidPose> poses_;
  std::unordered_map<int, const btCollisionObject*> known_;  // by id
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
