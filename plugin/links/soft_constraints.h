// Solves Bullet's own constraints within soft bodies, several bodies at once. Links are solved in
// groups of independent links (body_links.h), those of small bodies together; Bullet solves the
// rest. The result is the same, to the bit, as with Bullet (3.24) alone, if Bullet is built without
// fused multiply-adds.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <cstddef>
#include <memory>
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
  /// `threads`: how many `parallel_for` uses at most.
  void solve(const btAlignedObjectArray<btSoftBody*>& bodies, const ParallelFor& parallel_for,
             int threads = 2);

  /// Runs the passes over the links of body `index` of the last solve() that it has in a position
  /// iteration, with other positions than its own: by node, metres.
  void solve_links_again(btSoftBody& body, int index, Span<btVector3> positions);

 private:
  using Bodies = btAlignedObjectArray<btSoftBody*>;

  /// Small bodies near each other in the world's list.
  struct Block {
    std::vector<int> indices;                      ///< of the bodies, in the world
    std::vector<btSoftBody*> bodies, last_bodies;  ///< in this step and in the one before
    BodyLinks links;                               ///< of all of them
  };
  /// Bodies that one thread solves: those of a block, or one.
  struct Task {
    Block* block;  ///< null: one body
    int body;      ///< its index in the world, if there is no block
  };
  /// What is in the BodyLinks of a body.
  enum class LinksState : char {
    unknown,   ///< nothing of this step: it was solved with others
    prepared,  ///< the links of this step
    bullets    ///< nothing: Bullet solves the links
  };

  void make_tasks(const Bodies& bodies, Span<const int> parallel);
  void solve_block(Block& block);
  static bool solve_together(Block& block);
  void solve_alone(btSoftBody& body, int index);
  static bool solve_body(btSoftBody& body, BodyLinks& links);

  std::vector<BodyLinks> links_;    ///< by body
  std::vector<LinksState> states_;  ///< by body
  std::vector<std::unique_ptr<Block>> blocks_;
  std::vector<Task> tasks_;  ///< of this step
  std::vector<int> alone_;   ///< scratch memory: bodies in no block
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
