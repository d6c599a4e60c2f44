// Eigenvalues and linear systems of symmetric matrices, by Eigen.
#pragma once

#include "lazyccd/bullet/precision.h"
#include "util/dense.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

template <int Size>
struct SymmetricEigen {
  Matrix<Size, 1> values;      ///< ascending
  Matrix<Size, Size> vectors;  ///< column k has length 1 and belongs to value k

  /// Reads the lower triangle of the matrix.
  explicit SymmetricEigen(const Matrix<Size, Size>& matrix);
};

extern template struct SymmetricEigen<3>;
extern template struct SymmetricEigen<6>;

/// The inverse of a symmetric matrix times each column of `right`, which it replaces. The matrix
/// may be singular in directions that `right` has not.
void solve_symmetric(const DenseMatrix& matrix, DenseMatrix& right);
DenseVector solve_symmetric(const DenseMatrix& matrix, const DenseVector& right);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
