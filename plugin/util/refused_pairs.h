// Pairs with a soft body that the application keeps apart in Bullet's dispatch: by its own
// dispatcher, near callback, collision algorithm or solver.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <mutex>
#include <set>
#include <utility>
#include <vector>

#include "lazyccd/bullet/precision.h"

class btOverlappingPairCache;
struct btBroadphasePair;

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// A pair that is in Bullet's pair cache is refused if the dispatch does not bring it to the
/// solver. While Bullet's own classes dispatch, nothing is looked up.
class RefusedPairs {
 public:
  /// Starts a step, before the dispatch. `is_own_solver`: the solver's class is the application's.
  void begin_step(const btAlignedObjectArray<btSoftBody*>& bodies, bool is_own_solver);
  /// Takes a pair that came to the solver. Several threads may call it at the same time.
  void accept(const btCollisionObject& a, const btCollisionObject& b);
  /// Finds the pairs that this step refuses. Call it after the dispatch.
  void end_dispatch();
  /// Notices collision algorithms of the application for a soft body and this object. They count
  /// from the next step on.
  void look_for_algorithm(const btSoftBody& soft, const btCollisionObject& other);

  /// True if the last end_dispatch() changed anything.
  bool is_changed() const { return is_changed_; }
  bool is_empty() const { return refused_.empty(); }
  bool contains(const btCollisionObject& a, const btCollisionObject& b) const {
    return !refused_.empty() && refused_.count(pair_of(a, b)) > 0;
  }

 private:
  using Pair = std::pair<int, int>;  // ids of proxies, the smaller one first

  static Pair pair_of(const btCollisionObject& a, const btCollisionObject& b);
  bool is_refused(const btBroadphasePair& pair, const Pair& ids) const;

  const btSoftBodyWorldInfo* world_ = nullptr;
  bool has_own_algorithm_ = false, is_on_ = false, is_changed_ = false;
  std::mutex mutex_;
  std::vector<Pair> accepted_;  // in this step; sorted by end_dispatch()
  std::set<Pair> refused_;
  std::set<Pair> at_rest_;  // neither body was active at the end of the last dispatch
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
