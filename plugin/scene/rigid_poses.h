// The poses of a world's rigid bodies at the start and at the end of a step.
//
// A static or kinematic body moves from its pose at the end of the last step to its pose now. With
// several substeps a frame, a kinematic rigid body moves an equal part of its way in each. A
// dynamic body or a link moves from where the last step left it too, whether Bullet or the
// application moves it: joints that are set each step drive a link through cloth. A body that the
// application put elsewhere (rigid_displacement.h) starts where it was put, or moves there as its
// velocity says. If a body closes in on something that cannot move, its pose here is held at the
// start of the step. In later steps it catches up with Bullet's pose: per step it moves twice as
// far as Bullet's body, or a tenth of its lag if that is more.
//
// Most bodies of a world are static and far away. Of a body at rest that impulses do not move, only
// its transform is compared, until it is near.
#pragma once

#include <BulletCollision/BroadphaseCollision/btBroadphaseInterface.h>
#include <BulletCollision/CollisionDispatch/btCollisionObject.h>

#include <algorithm>
#include <optional>
#include <set>
#include <unordered_map>
#include <utility>
#include <vector>

#include "lazyccd/bullet/precision.h"
#include "motion/articulated_motion.h"
#include "shapes/axis_box.h"
#include "util/broadphase_members.h"
#include "util/warning_log.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// True for the kinds of object that soft bodies collide with: collision objects, rigid bodies and
/// links of multibodies.
bool is_rigid(const btCollisionObject& object);
/// True if contacts can move the object: a dynamic rigid body, or a link that a joint or a free
/// base of its multibody moves.
bool is_movable(const btCollisionObject& object);

/// One rigid body and its motion over the step.
struct RigidPose {
  btCollisionObject* object;
  int unique_id;  ///< of its broad phase proxy; tells new objects from old ones at the same address
  btTransform start, end;  ///< poses at both ends of the step
  /// Where its motion leads to at the end of the step; `end` may lag behind it. It is Bullet's pose
  /// or, between substeps, on the way to it (spread_over_substeps()).
  btTransform spread_pose;
  btTransform last_spread_pose;  ///< the same at the start of the step
  btTransform bullet_pose;       ///< Bullet's pose at the end of the step
  btTransform begin_pose;        ///< of a body that contacts can move: before Bullet moves it
  bool jumped = false;           ///< the application put it elsewhere (rigid_displacement.h)
  /// The application moved it since the last step, by more than rounding, and that is a part of its
  /// motion. Only of bodies that contacts can move.
  bool driven = false;
  bool finite = true;    ///< false: pose or velocity is not finite, and the body is left out
  bool at_rest = false;  ///< all poses are the same, and Bullet does not move the body

  /// Whether Bullet has the body ahead of its motion: this is not the last substep of a frame.
  bool lags() const { return !(spread_pose == bullet_pose); }
};

/// Bounds of the body at both ends of the step. Of a body at rest: Bullet's, which has updated them
/// in this step.
AxisBox bounds(const RigidPose& pose);

class RigidPoses {
 public:
  /// `jump_speed`: as in SolverOptions.
  explicit RigidPoses(btScalar jump_speed) : jump_speed_(jump_speed) {}

  /// Call begin_step() before Bullet moves anything and end_step() when it has. `broadphase` may be
  /// null: there are no rigid bodies then.
  void begin_step(btBroadphaseInterface* broadphase);
  void end_step(btBroadphaseInterface* broadphase, btScalar dt, WarningLog& warnings);
  /// After end_step(): also follows, in this step, the bodies at rest near one of the boxes.
  void follow(Span<const AxisBox> boxes, WarningLog& warnings);
  /// The bodies to which nodes are anchored, sorted. Bullet moves these nodes at the start of a
  /// frame, so the bodies move with them then.
  void set_carriers(std::vector<const btCollisionObject*> carriers) {
    carriers_ = std::move(carriers);
  }
  /// Makes the next end_step() take the body's displacement for a jump.
  void teleported(const btCollisionObject& object) { teleported_.insert(&object); }
  /// Holds a static or kinematic body at the start of this step. The next step sweeps it from
  /// there.
  void hold_at_start(const btCollisionObject& object);
  /// After end_step(): the bodies that the application moved, and that came near `box` in the step,
  /// were put elsewhere.
  void let_driven_jump(const AxisBox& box);
  /// After the response: the next step starts from where it left a body that contacts can move.
  void set_response_end(int unique_id, const btTransform& end);
  /// After the response, which moved multibodies: the next step starts from where Bullet has their
  /// links now.
  void take_link_ends();

  /// Pose of a multibody at the start of the step; null if it has no link that moves.
  const MultibodyPose* start_of(const btMultiBody& body) const;

  /// The bodies that are followed in this step: all that move or may be moved, and those near.
  /// Sorted by unique_id, because the broad phase has no defined order.
  const std::vector<const RigidPose*>& followed() const { return followed_; }
  /// Whether the body is new in this step.
  bool is_added(const RigidPose& pose) const {
    return std::binary_search(added_.begin(), added_.end(), pose.unique_id);
  }

 private:
  struct Known {
    const btCollisionObject* object;
    std::size_t index;  // in poses_
  };
  struct MultibodyPoses {
    std::optional<MultibodyPose> last_end;    // of the last step; none: not known
    MultibodyPose begin;                      // before Bullet moves it
    std::optional<MultibodyPose> end;         // none: not read yet
    bool any_driven = false, jumped = false;  // its links
  };
  class Collector;

  /// Finds bodies that were added or removed.
  void find(btBroadphaseInterface* broadphase);
  bool are_known(const std::vector<RigidPose>& found) const;
  /// Replaces poses_ by the poses that were found; those that are known stay as they are.
  void take(std::vector<RigidPose>& found);
  void set_end(RigidPose& pose, WarningLog& warnings);
  /// Makes the body new at its place.
  void jump(RigidPose& pose) const;
  /// If one link of a multibody has jumped, lets all that the application moved jump.
  void jump_with_multibodies();
  btTransform spread_pose(const RigidPose& pose) const;
  void list_followed();
  /// Of a link that moves: poses of its multibody. Otherwise null.
  MultibodyPoses* multibody_of(const RigidPose& pose);
  void read_multibody_ends();

  btScalar jump_speed_;
  btScalar dt_ = 1;                       // of this step, seconds
  std::vector<int> added_;                // in this step: unique_id, sorted
  std::vector<RigidPose> poses_;          // of all bodies, sorted by unique_id
  std::unordered_map<int, Known> known_;  // by unique_id
  std::vector<char> is_followed_;         // by index in poses_
  std::vector<const RigidPose*> followed_;
  BroadphaseMembers members_;
  std::vector<const btCollisionObject*> carriers_;
  std::set<const btCollisionObject*> teleported_;                       // since the last step
  std::unordered_map<const btMultiBody*, MultibodyPoses> multibodies_;  // with links that move
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
