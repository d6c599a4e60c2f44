// Small vectors and matrices of doubles as plain values. Each operation computes its result at
// once.
//
// Names are those of Eigen. Its own types are templates of expressions, which cost a second or more
// of compile time in each source. They stay in few sources: decompositions, rotations, and sums
// over many points. Sums add their terms in the order that Eigen's have on registers of two
// doubles, so the bits are the same with either.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace lazyccd::bullet {

template <int Rows, int Columns>
class Matrix;

using Vector2d = Matrix<2, 1>;
using Vector3d = Matrix<3, 1>;
using Vector6d = Matrix<6, 1>;
using Matrix3d = Matrix<3, 3>;
using Matrix6d = Matrix<6, 6>;

/// Adds term(first) to term(first + count - 1) by halves.
template <int first, int count, class Term>
double sum_by_halves(const Term& term) {
  constexpr int half = count / 2;
  if constexpr (count == 1) {
    return term(first);
  } else {
    return sum_by_halves<first, half>(term) + sum_by_halves<first + half, count - half>(term);
  }
}

/// A matrix, or a vector if it has one column. Elements are stored column after column. Without
/// arguments it is not initialized.
template <int Rows, int Columns>
class Matrix {
 public:
  static constexpr int size = Rows * Columns;

  Matrix() {}
  Matrix(double x, double y) : elements_{x, y} { static_assert(size == 2); }
  Matrix(double x, double y, double z) : elements_{x, y, z} { static_assert(size == 3); }

  static Matrix Constant(double value) {
    Matrix result;
    result.elements_.fill(value);
    return result;
  }
  static Matrix Zero() { return Constant(0); }
  static Matrix Ones() { return Constant(1); }
  static Matrix Identity() {
    Matrix result = Zero();
    for (int i = 0; i < (Rows < Columns ? Rows : Columns); ++i) result(i, i) = 1;
    return result;
  }
  static Matrix Unit(int i) {
    Matrix result = Zero();
    result[i] = 1;
    return result;
  }

  double& operator()(int row, int column) { return elements_[at(row, column)]; }
  double operator()(int row, int column) const { return elements_[at(row, column)]; }
  double& operator[](int i) { return elements_[static_cast<std::size_t>(i)]; }
  double operator[](int i) const { return elements_[static_cast<std::size_t>(i)]; }
  double& x() { return elements_[0]; }
  double& y() { return elements_[1]; }
  double& z() { return elements_[2]; }
  double x() const { return elements_[0]; }
  double y() const { return elements_[1]; }
  double z() const { return elements_[2]; }
  double* data() { return elements_.data(); }
  const double* data() const { return elements_.data(); }

  void setZero() { elements_.fill(0); }
  // Parts are copies; being const, they cannot be assigned to by mistake.
  const Matrix<Rows, 1> col(int column) const { return block<Rows, 1>(0, column); }
  const Matrix<1, Columns> row(int i) const { return block<1, Columns>(i, 0); }
  void set_col(int column, const Matrix<Rows, 1>& values) { set_block(0, column, values); }
  void set_row(int i, const Matrix<1, Columns>& values) { set_block(i, 0, values); }
  template <int R, int C>
  const Matrix<R, C> block(int first_row, int first_column) const {
    Matrix<R, C> result;
    for (int k = 0; k < C; ++k) {
      for (int i = 0; i < R; ++i) result(i, k) = (*this)(first_row + i, first_column + k);
    }
    return result;
  }
  template <int R, int C>
  void set_block(int first_row, int first_column, const Matrix<R, C>& values) {
    for (int k = 0; k < C; ++k) {
      for (int i = 0; i < R; ++i) (*this)(first_row + i, first_column + k) = values(i, k);
    }
  }
  template <int N>
  const Matrix<N, 1> head() const {
    return block<N, 1>(0, 0);
  }
  template <int N>
  const Matrix<N, 1> tail() const {
    return block<N, 1>(Rows - N, 0);
  }
  Matrix<Columns, Rows> transpose() const {
    Matrix<Columns, Rows> result;
    for (int k = 0; k < Columns; ++k) {
      for (int i = 0; i < Rows; ++i) result(k, i) = (*this)(i, k);
    }
    return result;
  }

  Matrix& operator+=(const Matrix& b) {
    return *this = zip(b, [](double x, double y) { return x + y; });
  }
  Matrix& operator-=(const Matrix& b) {
    return *this = zip(b, [](double x, double y) { return x - y; });
  }
  Matrix& operator*=(double factor) {
    return *this = map([factor](double x) { return x * factor; });
  }
  Matrix& operator/=(double divisor) {
    return *this = map([divisor](double x) { return x / divisor; });
  }
  friend Matrix operator+(Matrix a, const Matrix& b) { return a += b; }
  friend Matrix operator-(Matrix a, const Matrix& b) { return a -= b; }
  friend Matrix operator*(Matrix a, double factor) { return a *= factor; }
  friend Matrix operator*(double factor, Matrix a) { return a *= factor; }
  friend Matrix operator/(Matrix a, double divisor) { return a /= divisor; }
  Matrix operator-() const {
    return map([](double x) { return -x; });
  }
  friend bool operator==(const Matrix& a, const Matrix& b) {
    bool equal = true;
    for (int i = 0; i < size; ++i) equal &= a[i] == b[i];
    return equal;
  }
  friend bool operator!=(const Matrix& a, const Matrix& b) { return !(a == b); }

  Matrix cwiseProduct(const Matrix& b) const {
    return zip(b, [](double x, double y) { return x * y; });
  }
  Matrix cwiseMin(const Matrix& b) const {
    return zip(b, [](double x, double y) { return y < x ? y : x; });
  }
  Matrix cwiseMax(const Matrix& b) const {
    return zip(b, [](double x, double y) { return x < y ? y : x; });
  }
  Matrix cwiseMax(double b) const { return cwiseMax(Constant(b)); }
  Matrix cwiseAbs() const {
    return map([](double x) { return std::abs(x); });
  }
  Matrix cwiseSqrt() const {
    return map([](double x) { return std::sqrt(x); });
  }
  double minCoeff() const { return (*this)[least()]; }
  double maxCoeff() const { return (*this)[greatest()]; }
  /// The same, and the index of the first such element.
  double minCoeff(int* index) const { return (*this)[*index = least()]; }
  double maxCoeff(int* index) const { return (*this)[*index = greatest()]; }

  double sum() const {
    constexpr int pairs = size / 2;
    const double sum = sum_by_halves<0, pairs>([this](int i) { return (*this)[2 * i]; }) +
                       sum_by_halves<0, pairs>([this](int i) { return (*this)[2 * i + 1]; });
    return size % 2 == 0 ? sum : sum + elements_.back();
  }
  double dot(const Matrix& b) const { return cwiseProduct(b).sum(); }
  double squaredNorm() const { return dot(*this); }
  double norm() const { return std::sqrt(squaredNorm()); }
  /// Sum of the absolute values.
  double norm_1() const { return cwiseAbs().sum(); }
  /// Largest absolute value.
  double norm_infinity() const { return cwiseAbs().maxCoeff(); }
  /// Of length 1; a vector of length 0 stays.
  Matrix normalized() const {
    const double squared = squaredNorm();
    return squared > 0 ? *this / std::sqrt(squared) : *this;
  }
  /// True if all elements are 0.
  bool isZero() const { return *this == Zero(); }
  bool isIdentity() const { return *this == Identity(); }
  bool allFinite() const {
    bool finite = true;
    for (const double x : elements_) finite &= std::isfinite(x);
    return finite;
  }

  Matrix cross(const Matrix& b) const {
    static_assert(size == 3);
    return {y() * b.z() - z() * b.y(), z() * b.x() - x() * b.z(), x() * b.y() - y() * b.x()};
  }
  Matrix<Rows, 1> diagonal() const {
    static_assert(Rows == Columns);
    Matrix<Rows, 1> result;
    for (int i = 0; i < Rows; ++i) result[i] = (*this)(i, i);
    return result;
  }
  double trace() const {
    return sum_by_halves<0, Rows>([this](int i) { return (*this)(i, i); });
  }
  double determinant() const {
    static_assert(Rows == 3 && Columns == 3);
    const auto& m = *this;
    const auto part = [&m](int a, int b, int c) {
      return m(0, a) * (m(1, b) * m(2, c) - m(1, c) * m(2, b));
    };
    return part(0, 1, 2) - part(1, 0, 2) + part(2, 0, 1);
  }
  Matrix inverse() const {
    static_assert(Rows == 3 && Columns == 3);
    const auto cofactor = [this](int i, int k) {
      const auto& m = *this;
      const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, k1 = (k + 1) % 3, k2 = (k + 2) % 3;
      return m(i1, k1) * m(i2, k2) - m(i1, k2) * m(i2, k1);
    };
    const Vector3d first(cofactor(0, 0), cofactor(1, 0), cofactor(2, 0));
    const double scale = 1 / first.dot(col(0));
    Matrix result;
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) result(k, i) = cofactor(i, k) * scale;
    }
    return result;
  }

 private:
  static constexpr std::size_t at(int row, int column) {
    return static_cast<std::size_t>(row + Rows * column);
  }
  template <class Function>
  Matrix map(const Function& function) const {
    Matrix result;
    for (int i = 0; i < size; ++i) result[i] = function((*this)[i]);
    return result;
  }
  template <class Function>
  Matrix zip(const Matrix& b, const Function& function) const {
    Matrix result;
    for (int i = 0; i < size; ++i) result[i] = function((*this)[i], b[i]);
    return result;
  }
  int least() const {
    int best = 0;
    for (int i = 1; i < size; ++i) best = (*this)[i] < (*this)[best] ? i : best;
    return best;
  }
  int greatest() const {
    int best = 0;
    for (int i = 1; i < size; ++i) best = (*this)[best] < (*this)[i] ? i : best;
    return best;
  }

  std::array<double, static_cast<std::size_t>(size)> elements_;
};

template <int Rows, int Inner, int Columns>
Matrix<Rows, Columns> operator*(const Matrix<Rows, Inner>& a, const Matrix<Inner, Columns>& b) {
  Matrix<Rows, Columns> result;
  for (int k = 0; k < Columns; ++k) {
    for (int i = 0; i < Rows; ++i) {
      const auto term = [&](int j) { return a(i, j) * b(j, k); };
      if (Rows % 2 != 0 && i == Rows - 1) {  // others are computed two at a time
        result(i, k) = sum_by_halves<0, Inner>(term);
      } else {
        double sum = term(0);
        for (int j = 1; j < Inner; ++j) sum += term(j);
        result(i, k) = sum;
      }
    }
  }
  return result;
}

template <int Size>
Matrix<Size, Size> diagonal_matrix(const Matrix<Size, 1>& diagonal) {
  Matrix<Size, Size> result = Matrix<Size, Size>::Zero();
  for (int i = 0; i < Size; ++i) result(i, i) = diagonal[i];
  return result;
}

/// Its product with a vector is the cross product of `a` with it.
inline Matrix3d cross_matrix(const Vector3d& a) {
  Matrix3d result = Matrix3d::Zero();
  result(1, 0) = a.z();
  result(0, 1) = -a.z();
  result(0, 2) = a.y();
  result(2, 0) = -a.y();
  result(2, 1) = a.x();
  result(1, 2) = -a.x();
  return result;
}

/// Both, one after the other.
inline Vector6d stacked(const Vector3d& first, const Vector3d& second) {
  Vector6d result;
  result.set_block(0, 0, first);
  result.set_block(3, 0, second);
  return result;
}

/// Of three floats.
inline Vector3d vector_of(const float* x) {
  return {static_cast<double>(x[0]), static_cast<double>(x[1]), static_cast<double>(x[2])};
}

}  // namespace lazyccd::bullet
