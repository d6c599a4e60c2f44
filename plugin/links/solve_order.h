// In which turn constraints within soft bodies are solved, so that it comes to the same, to the
// bit, as one body after the other.
//
// Of what others may see, Bullet's solver of one soft body (3.24) reads and writes rigid bodies, at
// anchors and at contacts with them, and nodes of other soft bodies, at contacts with them and
// where a link or an anchor has one. All else is the body's own; so are its clusters, and joints
// are solved elsewhere. It calls what applications may set, the allocator and the profiler, as
// Bullet's own threads do.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <cstdint>
#include <vector>

#include "lazyccd/bullet/precision.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

// Of the bodies that are active, by their place in the world.
struct SolveOrder {
  std::vector<int> serial;      // one after the other
  std::vector<int> parallel;  // in any order, the most work first: none, or two and more
  std::int64_t work = 0;          // of those: links, each as often as it is gone over
};

SolveOrder find_solve_order(const btAlignedObjectArray<btSoftBody*>& bodies);

// How often Bullet goes over the links in an iteration over this sequence of solvers: of
// positions or drift (tPSolverArray), or of velocities (tVSolverArray).
template <class Sequence>
std::int64_t passes_over_links(const Sequence& sequence) {
  constexpr int linear = btSoftBody::ePSolver::Linear;
  static_assert(linear == static_cast<int>(btSoftBody::eVSolver::Linear));
  std::int64_t passes = 0;
  for (int i = 0; i < sequence.size(); ++i) passes += sequence[i] == linear;
  return passes;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
