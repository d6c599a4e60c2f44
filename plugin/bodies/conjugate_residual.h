// The method of conjugate residuals (Y. Saad, Iterative Methods for Sparse Linear Systems, 2nd
// edition, section 6.8) with a diagonal preconditioner. Bullet (3.24) has it as
// btConjugateResidual. The results are Bullet's, to the bit but for the sign of zeros, on any
// number of threads: each sum is added up in Bullet's order.
#pragma once

#include <LinearMath/btAlignedObjectArray.h>
#include <LinearMath/btVector3.h>

#include <functional>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/span.h"
#include "util/parallel_for.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

using VectorStack = btAlignedObjectArray<btVector3>;

class ConjugateResidual {
 public:
  /// Computes b = A x for the symmetric matrix A, for the unknowns of solve().
  using Multiply = std::function<void(const VectorStack& x, VectorStack& b)>;

  /// Makes room for systems of this size.
  void resize(int size);
  /// Solves A x = b for these unknowns, which A connects with no others. `x` is the initial guess,
  /// and then the solution. `preconditioner` is an approximate inverse of A: the elements of a
  /// diagonal matrix. Several threads may solve for disjoint sets of unknowns at the same time.
  void solve(Span<const int> unknowns, const Multiply& multiply, const VectorStack& preconditioner,
             const VectorStack& b, VectorStack& x, int max_iterations, btScalar tolerance,
             const ParallelFor& parallel_for);

 private:
  VectorStack r_, p_, a_p_, a_r_, other_x_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
