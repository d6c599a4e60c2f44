// Oriented boxes along the principal axes of a set of points (Gottschalk et al. 1996): moments,
// axes, extents and the separating axis test.
//
// A box is valid with any axes that are orthonormal up to rounding; the principal axes make it
// tight. A NaN spreads to the size of the box, and such a box is never apart from another.
#pragma once

#include <cmath>

#include "core/platform.h"

namespace lazyccd::research {

/// The set of points centre + sum of s_i axis_i with |s_i| <= half_i.
template <class T>
struct alignas(16) OrientedBoxOf {
  T centre[3], axis[3][3], half[3];
};
using OrientedBox = OrientedBoxOf<double>;

/// Moments of a set of points, for their covariance.
struct Moments {
  double count, sum[3], product[6];  // xx xy xz yy yz zz

  template <class T>
  LAZYCCD_HD void add(const T* x) {
    count += 1;
    for (int i = 0, at = 0; i < 3; ++i) {
      sum[i] += x[i];
      for (int j = i; j < 3; ++j) product[at++] += static_cast<double>(x[i]) * x[j];
    }
  }
  LAZYCCD_HD void add(const Moments& other) {
    count += other.count;
    for (int i = 0; i < 3; ++i) sum[i] += other.sum[i];
    for (int i = 0; i < 6; ++i) product[i] += other.product[i];
  }
};

namespace oriented_box {

/// Slack of a fitted box, relative to the largest magnitude involved. The extents of the box are
/// sums of fewer than 100 products. Each factor is off by a few roundings (2^-53), and so are the
/// axes from being orthonormal.
constexpr double kSlack = 0x1p-38;
constexpr double kTiny = 0x1p-1000;  ///< covers underflow of these products

/// Slack of the separating axis test, relative to D + H, the distance of the boxes and the sum of
/// their sides. Let u be the unit roundoff, and let the axes be orthonormal up to w. A product with
/// an axis is off by at most 7 u D, and a cosine by 3 u. The worst case is a cross product, which
/// is off by (32 u + 8 w) (D + H). w is 2^-48 in double, and 4 u if the axes were rounded to float.
template <class T>
struct AxisTestSlack;
template <>
struct AxisTestSlack<double> {
  static constexpr double slack = 0x1p-42, tiny = kTiny;
};
template <>
struct AxisTestSlack<float> {
  static constexpr float slack = 0x1p-16f, tiny = 0x1p-120f;
};

/// The larger and the smaller of two numbers; NaN if one of them is NaN.
LAZYCCD_HD inline double larger(double a, double b) { return a >= b || a != a ? a : b; }
LAZYCCD_HD inline double smaller(double a, double b) { return -larger(-a, -b); }

template <class T, class X>
LAZYCCD_HD inline T along(const T* axis, const X* x) {
  return axis[0] * x[0] + axis[1] * x[1] + axis[2] * x[2];
}

/// One rotation of the cyclic Jacobi method: makes m[p][q] of a symmetric matrix zero and rotates
/// the rows of `axis` accordingly.
template <int p, int q>
LAZYCCD_HD inline void rotate(float (&m)[3][3], float (&axis)[3][3]) {
  constexpr int r = 3 - p - q;
  if (m[p][q] == 0) return;
  const float theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
  const float t = (theta < 0 ? -1.0f : 1.0f) / (fabsf(theta) + sqrtf(theta * theta + 1));
  const float c = 1 / sqrtf(t * t + 1), s = t * c;
  m[p][p] -= t * m[p][q];
  m[q][q] += t * m[p][q];
  m[p][q] = m[q][p] = 0;
  const float rp = m[r][p], rq = m[r][q];
  m[r][p] = m[p][r] = c * rp - s * rq;
  m[r][q] = m[q][r] = s * rp + c * rq;
  for (int k = 0; k < 3; ++k) {
    const float x = axis[p][k], y = axis[q][k];
    axis[p][k] = c * x - s * y;
    axis[q][k] = s * x + c * y;
  }
}

/// Normalizes v, whose length is near 1. False if the length was not between 0.5 and 2, or NaN.
LAZYCCD_HD inline bool normalize(double (&v)[3]) {
  const double length = sqrt(along(v, v));
  for (double& x : v) x /= length;
  return length > 0.5 && length < 2;
}

}  // namespace oriented_box

/// Computes the principal axes, the rows of `axis`. They are orthonormal in double precision. They
/// are the eigenvectors of the covariance in single precision, or the axes of the world if the
/// covariance is not a number.
LAZYCCD_HD inline void principal_axes(const Moments& of, double (&axis)[3][3]) {
  using namespace oriented_box;
  const double x = of.sum[0] / of.count, y = of.sum[1] / of.count, z = of.sum[2] / of.count;
  const double covariance[6] = {of.product[0] / of.count - x * x, of.product[1] / of.count - x * y,
                                of.product[2] / of.count - x * z, of.product[3] / of.count - y * y,
                                of.product[4] / of.count - y * z, of.product[5] / of.count - z * z};
  double size = 0;
  for (const double c : covariance) size = larger(size, fabs(c));
  float unit[6];
  for (int i = 0; i < 6; ++i) unit[i] = static_cast<float>(covariance[i] / size);
  float m[3][3] = {
      {unit[0], unit[1], unit[2]}, {unit[1], unit[3], unit[4]}, {unit[2], unit[4], unit[5]}};
  float rows[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int sweep = 0; sweep < 4; ++sweep) {
    rotate<0, 1>(m, rows);
    rotate<0, 2>(m, rows);
    rotate<1, 2>(m, rows);
  }
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) axis[i][k] = rows[i][k];
  bool good = normalize(axis[0]);
  const double common = along(axis[0], axis[1]);
  for (int k = 0; k < 3; ++k) axis[1][k] -= common * axis[0][k];
  good = normalize(axis[1]) && good;
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    axis[2][k] = axis[0][i] * axis[1][j] - axis[0][j] * axis[1][i];
  }
  if (good) return;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) axis[i][k] = i == k;
}

/// The extent of points and boxes along three axes.
struct AxesExtent {
  double lo[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  double size = 0;  // upper bound of the magnitude of a coordinate

  template <class T>
  LAZYCCD_HD void add(const double (&axis)[3][3], const T* x) {
    for (int i = 0; i < 3; ++i) {
      const double s = oriented_box::along(axis[i], x);
      widen(i, s, s);
      size = oriented_box::larger(size, fabs(static_cast<double>(x[i])));
    }
  }
  LAZYCCD_HD void add(const double (&axis)[3][3], const OrientedBox& box) {
    using oriented_box::along;
    for (int i = 0; i < 3; ++i) {
      const double s = along(axis[i], box.centre);
      const double reach = box.half[0] * fabs(along(axis[i], box.axis[0])) +
                           box.half[1] * fabs(along(axis[i], box.axis[1])) +
                           box.half[2] * fabs(along(axis[i], box.axis[2]));
      widen(i, s - reach, s + reach);
      size =
          oriented_box::larger(size, fabs(box.centre[i]) + box.half[0] + box.half[1] + box.half[2]);
    }
  }
  LAZYCCD_HD void add(const AxesExtent& other) {
    for (int i = 0; i < 3; ++i) widen(i, other.lo[i], other.hi[i]);
    size = oriented_box::larger(size, other.size);
  }

 private:
  LAZYCCD_HD void widen(int i, double from, double to) {
    lo[i] = oriented_box::smaller(lo[i], from);
    hi[i] = oriented_box::larger(hi[i], to);
  }
};

/// Returns the box with this extent along the axes, wider by `margin` on every side.
LAZYCCD_HD inline OrientedBox enclose(const double (&axis)[3][3], const AxesExtent& extent,
                                      double margin) {
  using namespace oriented_box;
  OrientedBox box;
  double middle[3];
  for (int i = 0; i < 3; ++i) {
    middle[i] = 0.5 * extent.lo[i] + 0.5 * extent.hi[i];
    box.half[i] =
        0.5 * extent.hi[i] - 0.5 * extent.lo[i] + margin + kSlack * (extent.size + margin) + kTiny;
    for (int k = 0; k < 3; ++k) box.axis[i][k] = axis[i][k];
  }
  for (int k = 0; k < 3; ++k)
    box.centre[k] = middle[0] * axis[0][k] + middle[1] * axis[1][k] + middle[2] * axis[2][k];
  return box;
}

/// Returns a box in single precision that contains a box in double precision. Rounding moves the
/// centre by 2^-24 of its coordinates, and the axes by 2^-24: a fourth of what the sides grow by.
LAZYCCD_HD inline OrientedBoxOf<float> rounded(const OrientedBox& box) {
  using oriented_box::larger;
  const double size =
      larger(fabs(box.centre[0]), larger(fabs(box.centre[1]), fabs(box.centre[2]))) + box.half[0] +
      box.half[1] + box.half[2];
  OrientedBoxOf<float> result;
  for (int i = 0; i < 3; ++i) {
    result.centre[i] = static_cast<float>(box.centre[i]);
    result.half[i] = static_cast<float>(box.half[i] + 0x1p-22 * size) + 0x1p-120f;
    for (int k = 0; k < 3; ++k) result.axis[i][k] = static_cast<float>(box.axis[i][k]);
  }
  return result;
}

/// The separating axis test: whether the boxes are apart along one of 15 axes. Any separating
/// direction is a proof, so the axes need not be exact. A comparison with NaN is false.
template <class T>
LAZYCCD_HD inline bool apart(const OrientedBoxOf<T>& s, const OrientedBoxOf<T>& t) {
  using oriented_box::along;
  const auto magnitude = [](T x) { return x < 0 ? -x : x; };
  T between[3], size = 0;
  for (int k = 0; k < 3; ++k) {
    between[k] = t.centre[k] - s.centre[k];
    size += magnitude(between[k]) + s.half[k] + t.half[k];
  }
  const T slack =
      oriented_box::AxisTestSlack<T>::slack * size + oriented_box::AxisTestSlack<T>::tiny;
  T cosine[3][3], share[3][3];  // between axis i of s and axis j of t; its magnitude
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      cosine[i][j] = along(s.axis[i], t.axis[j]);
      share[i][j] = magnitude(cosine[i][j]);
    }
  }
  T in_s[3];
  for (int i = 0; i < 3; ++i) {
    in_s[i] = along(s.axis[i], between);
    if (magnitude(in_s[i]) > s.half[i] + along(share[i], t.half) + slack) return true;
  }
  for (int j = 0; j < 3; ++j) {
    const T column[3] = {share[0][j], share[1][j], share[2][j]};
    if (magnitude(along(t.axis[j], between)) > t.half[j] + along(column, s.half) + slack)
      return true;
  }
  // Along s_i x t_j, in the frame of s: its products with s_k and t_k are the other cosines.
  for (int i = 0; i < 3; ++i) {
    const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
    for (int j = 0; j < 3; ++j) {
      const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      const T distance = magnitude(in_s[i2] * cosine[i1][j] - in_s[i1] * cosine[i2][j]);
      const T reach = s.half[i1] * share[i2][j] + s.half[i2] * share[i1][j] +
                      t.half[j1] * share[i][j2] + t.half[j2] * share[i][j1];
      if (distance > reach + slack) return true;
    }
  }
  return false;
}

}  // namespace lazyccd::research
