// Solves Bullet's own constraints within soft bodies, several bodies at once. Links are solved in
// groups of independent links (body_links.h), those of small bodies together; Bullet solves the
// rest. The result is the same, to the bit, as with Bullet (3.24) alone, if Bullet is built without
// fused multiply-adds.
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
  void solve(const btAlignedObjectArray<btSoftBody*>& bodies, const ParallelFor& parallel_for);

  /// Runs the passes over the links of body `index` of the last solve() that it has in some
  /// position iterations.
  void solve_links_again(btSoftBody& body, int index, int iterations);

 private:
  using Bodies = btAlignedObjectArray<btSoftBody*>;

  /// Bodies that one thread solves: several small ones together, or one.
  struct Task {
    std::vector<int> bodies;  ///< indices in the world, ascending
    BodyLinks links;          ///< of several bodies
  };
  /// What is in the BodyLinks of a body.
  enum class LinksState : char {
    unknown,   ///< nothing of this step: it was solved with others
    prepared,  ///< the links of this step
    bullets    ///< nothing: Bullet solves the links
  };

  void make_tasks(const Bodies& bodies, const std::vector<int>& parallel);
  void solve(const Bodies& bodies, Task& task);
  /// Returns false, and does nothing, if Bullet is at least as fast.
  static bool solve_together(Span<btSoftBody* const> bodies, BodyLinks& links);
  void solve_alone(btSoftBody& body, int index);
  static bool solve(btSoftBody& body, BodyLinks& links);

  std::vector<BodyLinks> links_;    ///< by body
  std::vector<LinksState> states_;  ///< by body
  std::vector<Task> tasks_;         ///< the first task_count_ are of this step
  std::size_t task_count_ = 0;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
