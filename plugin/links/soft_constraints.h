// Solves Bullet's own constraints within soft bodies, several bodies at once. Links are solved in
// groups of independent links (body_links.h); Bullet solves the rest. The result is the same, to
// the bit, as with Bullet (3.24) alone, if Bullet is built without fused multiply-adds.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <vector>

#include "lazyccd/bullet/precision.h"
#include "links/body_links.h"
#include "util/parallel_for.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class SoftConstraints {
 public:
  /// Same as btDefaultSoftBodySolver::solveConstraints(). If it throws (std::bad_alloc), each body
  /// is either unchanged or solved; only a body whose own solver throws may be half solved.
  /// `threads`: with one thread the bodies are solved in Bullet's order.
  void solve(const btAlignedObjectArray<btSoftBody*>& bodies, const ParallelFor& parallel_for,
             int threads = 2);

  /// Runs the passes over the links of body `index` of the last solve() that it has in some
  /// position iterations.
  void solve_links_again(btSoftBody& body, int index, int iterations);

 private:
  /// Returns whether `links` solved them, and not Bullet.
  static bool solve(btSoftBody& body, BodyLinks& links);

  std::vector<BodyLinks> links_;   ///< by body
  std::vector<char> is_prepared_;  ///< by body: its BodyLinks hold the links of this step
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
