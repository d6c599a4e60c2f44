// Vector operations of the peers, in either precision.
#pragma once

#include <array>

#include "lazyccd/query.h"

namespace lazyccd::peers {

template <class Real>
using Vec3 = std::array<Real, 3>;

template <class Real>
Vec3<Real> operator+(const Vec3<Real>& a, const Vec3<Real>& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}

template <class Real>
Vec3<Real> operator-(const Vec3<Real>& a, const Vec3<Real>& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

template <class Real>
Vec3<Real> operator*(Real s, const Vec3<Real>& a) {
  return {s * a[0], s * a[1], s * a[2]};
}

template <class Real>
Real dot(const Vec3<Real>& a, const Vec3<Real>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

template <class Real>
Vec3<Real> cross(const Vec3<Real>& a, const Vec3<Real>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// Rounds world coordinates to the working precision, as an engine in that precision holds them.
template <class Real>
std::array<Vec3<Real>, 8> rounded(const QueryPoints& points) {
  std::array<Vec3<Real>, 8> x;
  for (int i = 0; i < 8; ++i)
    for (int c = 0; c < 3; ++c) x[i][c] = Real(points[i][c]);
  return x;
}

/// Three vectors whose triple product (a x b) . c is zero if the four points are coplanar, at the
/// start (0) and at the end (1) of the step.
///   vertex_face: a and b are the edges of the face from its first vertex; c goes from there to the
///                vertex
///   edge_edge:   a and b are the two edges; c goes from the start of the first to that of the
///   second
template <class Real>
struct Frame {
  Vec3<Real> a[2], b[2], c[2];
};

template <class Real>
Frame<Real> frame(ContactKind kind, const std::array<Vec3<Real>, 8>& x) {
  Frame<Real> f;
  for (int end = 0; end < 2; ++end) {
    const Vec3<Real>* p = &x[4 * end];
    if (kind == ContactKind::vertex_face) {
      f.a[end] = p[2] - p[1];
      f.b[end] = p[3] - p[1];
      f.c[end] = p[0] - p[1];
    } else {
      f.a[end] = p[1] - p[0];
      f.b[end] = p[3] - p[2];
      f.c[end] = p[2] - p[0];
    }
  }
  return f;
}

}  // namespace lazyccd::peers
