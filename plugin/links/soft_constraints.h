// Bullet's own constraints within soft bodies: links in groups of such as do not wait for each
// other (body_links.h), the rest by Bullet, and several bodies at once. The result is the same, to
// the bit, as of Bullet (3.24) alone, where that is built without fused multiply-adds.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <cstddef>
#include <functional>
#include <vector>

#include "links/body_links.h"
#include "lazyccd/bullet/precision.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Runs body(first, last) over disjoint ranges of [0, count): Threads::parallel_for.
using ParallelFor =
    std::function<void(std::size_t count, std::size_t grain,
                       const std::function<void(std::size_t first, std::size_t last)>& body)>;

class SoftConstraints {
 public:
  // As btDefaultSoftBodySolver::solveConstraints(). Where it throws (std::bad_alloc), bodies are as
  // they were, or solved; the one within whose own solver it throws may have been begun with.
  void solve(const btAlignedObjectArray<btSoftBody*>& bodies, const ParallelFor& parallel_for);

 private:
  static void solve(btSoftBody& body, BodyLinks& links);

  std::vector<BodyLinks> links_;  // by body
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
