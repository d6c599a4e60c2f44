// How the last step ended. The next step sees from it which bodies were placed elsewhere in
// between.
#pragma once

#include <LinearMath/btTransform.h>

#include <cstddef>
#include <vector>

#include "motion/motion.h"
#include "scene/obstacles.h"
#include "scene/soft_scene.h"
#include "scene/step_topology.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class PreviousStep {
 public:
  /// Remembers where the step's bodies end. Of sleepers that were left out it keeps what it knew.
  void remember(const SoftScene& scene, const Sleepers& sleepers, const Obstacles& obstacles,
                const StepTopology& topology, const Motion& motion);
  /// Forgets the soft bodies: nothing is known of where the next step finds them.
  void forget_soft_bodies() {
    soft_bodies_.clear();
    left_out_.clear();
  }
  /// Forgets one soft body.
  void forget(const btCollisionObject& body);

  /// Positions of a body's vertices at the end of the last step, three scalars each. Null if the
  /// body is new or has another number of vertices. Fast if bodies are asked for in their last
  /// order.
  const std::vector<btScalar>* end_of(const SoftScene::BodyRecord& record);
  /// Largest distance that a pinned node of the body of the last end_of() moved in the last step,
  /// metres.
  btScalar pinned_displacement() const { return pinned_displacement_; }
  /// True if an obstacle is new, changed, jumped, or is dynamic and not where the last step left
  /// it.
  bool is_new(const Obstacles::Record& obstacle) const;

 private:
  struct SoftBody {
    bool is_of(const SoftScene::BodyRecord& record) const;

    const btSoftBody* body;
    int proxy_id;  // of the broad phase; tells new bodies from old ones at the same address
    btScalar pinned_displacement;  // the largest, metres
    std::vector<btScalar> positions;
  };
  struct Obstacle {
    int unique_id;  // as in RigidPose
    btTransform end;
  };

  void set_aside(const Sleepers& sleepers);
  const SoftBody* find(const SoftScene::BodyRecord& record);

  std::vector<SoftBody> soft_bodies_;  // empty if the last step is not known
  std::vector<SoftBody> left_out_;     // sleepers
  std::size_t next_ = 0;               // where the next body is expected
  btScalar pinned_displacement_ = 0;   // of the body of the last end_of(), metres
  std::vector<Obstacle> obstacles_;    // sorted by unique_id
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
