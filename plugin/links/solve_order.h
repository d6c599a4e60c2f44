// Finds an order of soft bodies in which their constraints can be solved, several bodies at once,
// with the same result, to the bit, as one body after the other.
//
// Bullet's solver of one soft body (3.24) reads and writes two kinds of shared data. The first is
// rigid bodies, at anchors and at contacts with them. The second is nodes of other soft bodies, at
// contacts with them and if a link or an anchor has such a node. All other data is the body's own,
// and so are its clusters; joints are solved elsewhere. The solver calls functions that
// applications may set, the allocator and the profiler, in the same way as Bullet's own threads do.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <cstdint>

#include "lazyccd/bullet/precision.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Active bodies, by index in the world.
struct SolveOrder {
  ScratchVector<int> serial;    ///< one after the other
  ScratchVector<int> parallel;  ///< in any order; empty, or at least two, in ascending order
  std::int64_t work = 0;        ///< links in `parallel`, times passes over them
};

/// All active bodies one after the other.
SolveOrder bullets_order(const btAlignedObjectArray<btSoftBody*>& bodies);
SolveOrder find_solve_order(const btAlignedObjectArray<btSoftBody*>& bodies);

/// Number of passes over the links in one iteration of a solver sequence: of positions or drift
/// (tPSolverArray), or of velocities (tVSolverArray).
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
