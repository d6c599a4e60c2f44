// The method of conjugate residuals (Y. Saad, Iterative Methods for Sparse Linear Systems, 2nd
// edition, section 6.8) with a diagonal preconditioner. Bullet (3.24) has it as
// btConjugateResidual. The results are Bullet's, to the bit but for the sign of zeros, on any
// number of threads: each sum is added up in Bullet's order.
#pragma once

#include <LinearMath/btAlignedObjectArray.h>
#include <LinearMath/btVector3.h>

#include <functional>
#include <vector>

#include "bodies/ordered_sum.h"
#include "lazyccd/bullet/precision.h"
#include "util/parallel_for.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

using VectorStack = btAlignedObjectArray<btVector3>;

class ConjugateResidual {
 public:
  /// Computes b = A x for the symmetric matrix A.
  using Multiply = std::function<void(const VectorStack& x, VectorStack& b)>;

  /// Solves A x = b. `x` is the initial guess, and then the solution. `preconditioner` is an
  /// approximate inverse of A: the elements of a diagonal matrix.
  void solve(const Multiply& multiply, const VectorStack& preconditioner, const VectorStack& b,
             VectorStack& x, int max_iterations, btScalar tolerance,
             const ParallelFor& parallel_for);

 private:
  // Largest absolute value of a component of residual(i), as Bullet finds it: what comes before a
  // NaN is forgotten.
  template <class Residual>
  btScalar largest(const ParallelFor& parallel_for, std::size_t count, const Residual& residual);

  VectorStack r_, p_, a_p_, a_r_, other_x_;
  OrderedSum sum_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
