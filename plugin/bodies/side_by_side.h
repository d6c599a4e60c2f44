// Runs a function of Bullet for each soft body, several bodies at once. The result is the same as
// for one body after the other, because only bodies take part that share nothing. What else
// Bullet's functions reach is read only, except what applications may set: the allocator and the
// profiler. Bullet's own threads call these in the same way.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <cstddef>
#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/threads.h"
#include "util/parallel_for.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class SideBySide {
 public:
  using Bodies = btAlignedObjectArray<btSoftBody*>;

  explicit SideBySide(const Threads& threads)
      : threads_(threads),
        parallel_for_([threads](std::size_t count, std::size_t grain,
                                FunctionRef<void(std::size_t, std::size_t)> body) {
          threads.parallel_for(count, grain, body);
        }) {}

  /// Looks at the bodies of a step. `is_alone(body)`: no function that will be run for the body
  /// reaches another body's nodes. Call it again after topology may have changed.
  void begin(const Bodies& bodies, bool (*is_alone)(const btSoftBody& body));

  /// Calls visit(i) for the bodies of begin(): in any order if all are alone, otherwise in their
  /// order. Rethrows the first exception.
  void for_each(FunctionRef<void(int body)> visit) const;

  /// The number of threads that parallel_for() uses at most.
  int threads() const { return threads_.is_caller_only() ? 1 : threads_.count(); }
  const ParallelFor& parallel_for() const { return parallel_for_; }

 private:
  Threads threads_;
  ParallelFor parallel_for_;
  std::vector<int> order_;  // of the bodies; most nodes first if several may be visited at once
  bool is_parallel_ = false;
};

/// Return true if the elements of a body have its own nodes only.
bool has_own_faces(const btSoftBody& body);
bool has_own_links(const btSoftBody& body);
bool has_own_tetrahedra(const btSoftBody& body);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
