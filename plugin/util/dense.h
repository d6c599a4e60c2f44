// Vectors and matrices of doubles whose size is known at run time, as plain values. Names are those
// of Matrix (matrix.h).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace lazyccd::bullet {

class DenseVector {
 public:
  DenseVector() = default;
  explicit DenseVector(std::size_t size) : elements_(size, 0.0) {}  ///< zeros
  template <class Iterator>
  DenseVector(Iterator first, Iterator last) : elements_(first, last) {}

  std::size_t size() const { return elements_.size(); }
  double& operator[](std::size_t i) { return elements_[i]; }
  double operator[](std::size_t i) const { return elements_[i]; }
  double* data() { return elements_.data(); }
  const double* data() const { return elements_.data(); }
  auto begin() const { return elements_.begin(); }
  auto end() const { return elements_.end(); }
  void setZero() { std::fill(elements_.begin(), elements_.end(), 0.0); }

  DenseVector& operator+=(const DenseVector& b) {
    for (std::size_t i = 0; i < size(); ++i) elements_[i] += b[i];
    return *this;
  }
  DenseVector& operator-=(const DenseVector& b) {
    for (std::size_t i = 0; i < size(); ++i) elements_[i] -= b[i];
    return *this;
  }
  DenseVector& operator*=(double factor) {
    for (double& x : elements_) x *= factor;
    return *this;
  }
  DenseVector& operator/=(double divisor) {
    for (double& x : elements_) x /= divisor;
    return *this;
  }
  friend DenseVector operator+(DenseVector a, const DenseVector& b) { return a += b; }
  friend DenseVector operator-(DenseVector a, const DenseVector& b) { return a -= b; }
  friend DenseVector operator*(double factor, DenseVector a) { return a *= factor; }
  friend DenseVector operator/(DenseVector a, double divisor) { return a /= divisor; }

  friend bool operator==(const DenseVector& a, const DenseVector& b) {
    return a.elements_ == b.elements_;
  }

  double dot(const DenseVector& b) const {
    double sum = 0;
    for (std::size_t i = 0; i < size(); ++i) sum += elements_[i] * b[i];
    return sum;
  }
  /// Largest absolute value; 0 without elements.
  double norm_infinity() const {
    double largest = 0;
    for (const double x : elements_) largest = std::max(largest, std::abs(x));
    return largest;
  }
  bool isZero() const {
    return std::all_of(begin(), end(), [](double x) { return x == 0; });
  }

 private:
  std::vector<double> elements_;
};

class DenseMatrix {
 public:
  DenseMatrix() = default;
  DenseMatrix(std::size_t rows, std::size_t columns) : rows_(rows), elements_(rows * columns) {}

  std::size_t rows() const { return rows_; }
  std::size_t columns() const { return rows_ == 0 ? 0 : elements_.size() / rows_; }
  double& operator()(std::size_t row, std::size_t column) {
    return elements_[row + rows_ * column];
  }
  double operator()(std::size_t row, std::size_t column) const {
    return elements_[row + rows_ * column];
  }
  double* data() { return elements_.data(); }  ///< column after column
  const double* data() const { return elements_.data(); }
  DenseVector row(std::size_t i) const {
    DenseVector result(columns());
    for (std::size_t k = 0; k < columns(); ++k) result[k] = (*this)(i, k);
    return result;
  }

  friend bool operator==(const DenseMatrix& a, const DenseMatrix& b) {
    return a.rows_ == b.rows_ && a.elements_ == b.elements_;
  }
  friend DenseVector operator*(const DenseMatrix& a, const DenseVector& x) {
    DenseVector result(a.rows());
    for (std::size_t k = 0; k < a.columns(); ++k) {
      for (std::size_t i = 0; i < a.rows(); ++i) result[i] += a(i, k) * x[k];
    }
    return result;
  }

 private:
  std::size_t rows_ = 0;
  std::vector<double> elements_;
};

}  // namespace lazyccd::bullet
