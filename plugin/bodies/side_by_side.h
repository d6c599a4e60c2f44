// Runs a function of Bullet for each soft body, several bodies at once. The result is the same as
// for one body after the other, because only bodies take part that share nothing. What else Bullet's
// functions reach is read only, except what applications may set: the allocator and the profiler.
// Bullet's own threads call these in the same way.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

#include "lazyccd/bullet/precision.h"
#include "util/parallel_for.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class SideBySide {
 public:
  using Bodies = btAlignedObjectArray<btSoftBody*>;

  explicit SideBySide(ParallelFor parallel_for) : parallel_for_(std::move(parallel_for)) {}

  /// Looks at the bodies of a step. Call it again after topology may have changed.
  void begin(const Bodies& bodies);

  /// Calls visit(i) for the bodies of begin(): in any order if none has another's nodes, otherwise
  /// in their order. Rethrows the first exception.
  void for_each(const std::function<void(int body)>& visit) const;

  const ParallelFor& parallel_for() const { return parallel_for_; }

 private:
  ParallelFor parallel_for_;
  std::vector<int> order_;  // of the bodies; most nodes first if they are independent
  bool are_independent_ = false;
  bool are_small_ = true;  // to wake a thread takes longer than to visit all nodes
};

/// True if faces, links, tetrahedra and anchors of the body have its own nodes only.
bool has_only_own_nodes(const btSoftBody& body);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
