#include "util/decompositions.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

Eigen::Map<const Eigen::MatrixXd> view_of(const double* elements, std::size_t rows,
                                          std::size_t columns) {
  return {elements, static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(columns)};
}

}  // namespace

// Of 3 x 3 matrices Eigen has an algorithm of its own. Of larger ones the size is not known at
// compile time: unrolled code takes seconds to compile, and few bodies need it.
template <int Size>
SymmetricEigen<Size>::SymmetricEigen(const Matrix<Size, Size>& matrix) {
  constexpr int fixed = Size == 3 ? 3 : Eigen::Dynamic;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, fixed, fixed>> solver(
      view_of(matrix.data(), Size, Size));
  std::copy_n(solver.eigenvalues().data(), Size, values.data());
  std::copy_n(solver.eigenvectors().data(), Size * Size, vectors.data());
}

template struct SymmetricEigen<3>;
template struct SymmetricEigen<6>;

void solve_symmetric(const DenseMatrix& matrix, DenseMatrix& right) {
  const std::size_t size = matrix.rows();
  const Eigen::LDLT<Eigen::MatrixXd> factors(view_of(matrix.data(), size, size));
  for (std::size_t k = 0; k < right.columns(); ++k) {
    const Eigen::VectorXd column = view_of(right.data() + k * size, size, 1);
    const Eigen::VectorXd solution = factors.solve(column);
    std::copy_n(solution.data(), size, right.data() + k * size);
  }
}

DenseVector solve_symmetric(const DenseMatrix& matrix, const DenseVector& right) {
  DenseMatrix column(right.size(), 1);
  std::copy(right.begin(), right.end(), column.data());
  solve_symmetric(matrix, column);
  return {column.data(), column.data() + right.size()};
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
