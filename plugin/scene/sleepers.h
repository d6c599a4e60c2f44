// Which soft bodies take part in a step. Left out are bodies that sleep while nothing awake comes
// near them. They are neither read nor detected, and they cost a few comparisons each.
//
// A body sleeps if its activation state was ISLAND_SLEEPING when the step began and still is after
// Bullet's islands. It takes part again if the bounds of something awake, over the step, reach its
// bounds. Then it takes part for some steps, because new members cost a new topology. If the
// application moves a sleeper, a few sampled nodes show it.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <vector>

#include "shapes/axis_box.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class Sleepers {
 public:
  using Bodies = btAlignedObjectArray<btSoftBody*>;
  using Boxes = ScratchVector<AxisBox>;

  /// A soft body that takes part in the step.
  struct Member {
    btSoftBody* body;
    int world_index;  ///< position in the world's array of soft bodies
    bool sleeps;
  };

  /// Notes which bodies sleep. Call it before Bullet moves anything.
  void begin_step(const Bodies& bodies);
  /// Finds the members of the step. Call it when Bullet has moved everything.
  void find_members(const Bodies& bodies);
  /// In the world's order.
  const std::vector<Member>& members() const { return members_; }
  int left_out_count() const { return left_out_count_; }
  /// Largest collision margin of a body that sleeps, metres.
  btScalar largest_margin() const { return largest_margin_; }
  std::vector<const btSoftBody*> left_out() const;  ///< in the world's order
  /// Makes sleepers take part that come within `distance` metres of one of `awake`. Returns true if
  /// there are new members. `awake`: bounds of what may push a sleeper, over the step.
  bool take_in(const Bodies& bodies, const Boxes& awake, btScalar distance);
  /// Sleepers that stay beyond `distance` of all of `awake` for some steps are left out afterwards.
  void end_step(const Boxes& awake, btScalar distance);
  /// Makes the next step look at a body, or at all bodies, as if they had just fallen asleep.
  void forget(const btCollisionObject& body);
  void forget_all() { sleepers_.clear(); }

 private:
  struct Sleeper {
    explicit Sleeper(btSoftBody& body);
    bool is_changed() const;
    // Prefetches what is_changed() reads: the bodies lie far apart in memory.
    void prefetch() const;
    bool is_left_out() const;

    btSoftBody* body;
    int proxy_id;    // of the broad phase; tells new bodies from old ones at the same address
    AxisBox bounds;  // of all nodes
    btScalar margin;
    bool drifts;                    // moves although it sleeps
    const btSoftBody::Node* nodes;  // only for prefetch()
    std::vector<int> sampled_nodes;
    int node_count;
    std::vector<btVector3> sample;  // as it was when the body fell asleep
    int steps_alone;                // consecutive steps in which nothing awake came near
  };

  // True if the bodies that sleep are those of the last step, and unchanged.
  bool are_same(const Bodies& bodies) const;

  std::vector<Sleeper> sleepers_;  // in the world's order
  std::vector<Member> members_;
  int left_out_count_ = 0;
  btScalar largest_margin_ = 0;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
