// Certified tests for continuous normal cones with the contour condition (Volino and
// Magnenat-Thalmann 1994; Tang et al. 2008). They prove that a part of a surface cannot touch
// itself during the step.
//
// A patch is a set of faces of one surface. Assume that all its faces have positive area at every
// time of the step, when seen along a direction v. Assume also that its boundary, seen so, is one
// closed curve that never meets itself. Then the patch covers a generic point of the view plane as
// often as the boundary winds around it: 0 or 1 times. So the view is one-to-one, and two points of
// the patch that coincide are the same point. The detector does not test primitives that share a
// vertex.
//
// The cone of normals is stored as the set of those of 26 directions that lie in it. This costs a
// few additions per face and one AND per node, and no angle is ever rounded.
//
// In this file a vertex is three coordinates at the start and three at the end of the step. A
// comparison with NaN is false, and then nothing is proved.
#pragma once

#include <cmath>
#include <cstdint>

#include "core/lane.h"
#include "core/platform.h"
#include "core/vec.h"

namespace lazyccd::research {

/// A direction of view, and two more directions whose coordinates span the view plane. The
/// directions of view are the axes and diagonals of a cube, up to sign.
struct View {
  int along[3], u[3], w[3];
};
constexpr int kViews = 13;

LAZYCCD_HD inline const View& view(int i) {
  static constexpr View views[kViews] = {
      {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},   {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}},
      {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}},   {{1, 1, 0}, {0, 0, 1}, {1, -1, 0}},
      {{1, -1, 0}, {1, 1, 0}, {0, 0, 1}},  {{0, 1, 1}, {1, 0, 0}, {0, 1, -1}},
      {{0, 1, -1}, {0, 1, 1}, {1, 0, 0}},  {{1, 0, 1}, {0, 1, 0}, {-1, 0, 1}},
      {{1, 0, -1}, {0, 1, 0}, {1, 0, 1}},  {{1, 1, 1}, {1, -1, 0}, {0, 1, -1}},
      {{1, 1, -1}, {1, -1, 0}, {0, 1, 1}}, {{1, -1, 1}, {1, 1, 0}, {0, 1, 1}},
      {{-1, 1, 1}, {1, 1, 0}, {0, 1, -1}},
  };
  return views[i];
}

/// A set of directions: bit i for view i, bit 16 + i for its opposite.
using Directions = std::uint32_t;

/// Returns one of the views in the set, in either direction; -1 if the set is empty.
LAZYCCD_HD inline int view_of(Directions cone) {
  for (int i = 0; i < kViews; ++i)
    if ((cone >> i | cone >> (16 + i)) & 1) return i;
  return -1;
}

template <class Coordinate>
LAZYCCD_HD inline Vec3<double> position(const Coordinate* x, int end) {
  return {x[3 * end], x[3 * end + 1], x[3 * end + 2]};
}

LAZYCCD_HD inline double component_along(const int (&direction)[3], const Vec3<double>& p) {
  return direction[0] * p.x + direction[1] * p.y + direction[2] * p.z;
}

LAZYCCD_HD inline double largest_component(const Vec3<double>& p) {
  return lane_max(fabs(p.x), lane_max(fabs(p.y), fabs(p.z)));
}

/// Returns the views along which a face has positive area, or negative area, during the whole step.
/// Its normal e1(t) x e2(t) is a quadratic; the products of its Bernstein coefficients with the
/// direction must all have one sign.
///
/// Rounding, in units of u = 2^-53 times E1 E2, the largest components over the step:
///   product of two rounded differences           3
///   component of a cross product                 8
///   component of the mean of two of them        10
///   product with a direction       3 * 10 + 12 = 42
/// So 64 is a bound; 2^-1000 covers underflow.
template <class Coordinate>
LAZYCCD_HD inline Directions views_of_face(const Coordinate* a, const Coordinate* b,
                                           const Coordinate* c) {
  Vec3<double> e1[2], e2[2];
  double size1 = 0, size2 = 0;
  for (int end = 0; end < 2; ++end) {
    const Vec3<double> origin = position(a, end);
    e1[end] = position(b, end) - origin;
    e2[end] = position(c, end) - origin;
    size1 = lane_max(size1, largest_component(e1[end]));
    size2 = lane_max(size2, largest_component(e2[end]));
  }
  const Vec3<double> normals[3] = {
      cross(e1[0], e2[0]), 0.5 * (cross(e1[0], e2[1]) + cross(e1[1], e2[0])), cross(e1[1], e2[1])};
  const double error = 0x1p-47 * (size1 * size2) + 0x1p-1000;
  Directions views = 0;
  for (int i = 0; i < kViews; ++i) {
    bool towards = true, away = true;
    for (const Vec3<double>& n : normals) {
      const double area = component_along(view(i).along, n);
      towards = towards && area > error;
      away = away && area < -error;
    }
    if (towards) views |= Directions{1} << i;
    if (away) views |= Directions{1} << (16 + i);
  }
  return views;
}

/// The boundary of a patch as seen along a view: a closed curve of vertices.
class Contour {
 public:
  /// size: the largest magnitude of a coordinate of the boundary's vertices.
  LAZYCCD_HD Contour(const View& view, double size)
      : view_(view),
        // A seen coordinate is the sum of at most four coordinates. Each of its three roundings is
        // at most 4 u times size.
        error_(0x1p-47 * size + 0x1p-1000) {}

  /// A vertex at both ends of the step, in four directions of the plane: u, w, u + w and u - w.
  static constexpr int kDirections = 4;
  struct Seen {
    double s[2][kDirections];
  };
  template <class Coordinate>
  LAZYCCD_HD Seen seen(const Coordinate* vertex) const {
    Seen result;
    for (int end = 0; end < 2; ++end) {
      const Vec3<double> p = position(vertex, end);
      const double u = component_along(view_.u, p), w = component_along(view_.w, p);
      double* s = result.s[end];
      s[0] = u;
      s[1] = w;
      s[2] = u + w;
      s[3] = u - w;
    }
    return result;
  }

  /// One side of the curve: its range in each direction.
  struct Side {
    double lo[2][kDirections], hi[2][kDirections];

    LAZYCCD_HD Side(const Seen& a, const Seen& b) {
      for (int end = 0; end < 2; ++end) {
        for (int k = 0; k < kDirections; ++k) {
          lo[end][k] = lane_min(a.s[end][k], b.s[end][k]);
          hi[end][k] = lane_max(a.s[end][k], b.s[end][k]);
        }
      }
    }
  };

  /// Whether two sides that are not neighbours certainly never meet. In one of the directions they
  /// do not overlap, in the same order at both ends. The motion is linear, so this holds at all
  /// times.
  LAZYCCD_HD bool apart(const Side& a, const Side& b) const {
    for (int k = 0; k < kDirections; ++k) {
      if (a.lo[0][k] - b.hi[0][k] > error_ && a.lo[1][k] - b.hi[1][k] > error_) return true;
      if (b.lo[0][k] - a.hi[0][k] > error_ && b.lo[1][k] - a.hi[1][k] > error_) return true;
    }
    return false;
  }

  /// Whether the neighbouring sides a-b and b-c certainly never fold onto each other. Either both
  /// go forward in one direction at all times, or they always turn to the same side.
  LAZYCCD_HD bool turns(const Seen& a, const Seen& b, const Seen& c) const {
    for (int k = 0; k < kDirections; ++k) {
      bool forward = true, backward = true;
      for (int end = 0; end < 2; ++end) {
        const double steps[2] = {b.s[end][k] - a.s[end][k], c.s[end][k] - b.s[end][k]};
        for (const double step : steps) {
          forward = forward && step > error_;
          backward = backward && step < -error_;
        }
      }
      if (forward || backward) return true;
    }
    // cross(t) is a quadratic; its Bernstein coefficients must have one sign. Its factors are at
    // most `size`. Their error is error_ plus one rounding, which is smaller than error_. Over four
    // products the error is below 16 error_ (size + error_).
    double p[2][2], q[2][2], size = 0;  // [end][coordinate] of b - a and c - b
    for (int end = 0; end < 2; ++end) {
      for (int k = 0; k < 2; ++k) {
        p[end][k] = b.s[end][k] - a.s[end][k];
        q[end][k] = c.s[end][k] - b.s[end][k];
        size = lane_max(size, lane_max(fabs(p[end][k]), fabs(q[end][k])));
      }
    }
    const auto area = [&](int i, int j) { return p[i][0] * q[j][1] - p[i][1] * q[j][0]; };
    const double areas[3] = {area(0, 0), 0.5 * (area(0, 1) + area(1, 0)), area(1, 1)};
    const double error = 16 * error_ * (size + error_) + 0x1p-1000;
    bool left = true, right = true;
    for (const double x : areas) {
      left = left && x > error;
      right = right && x < -error;
    }
    return left || right;
  }

 private:
  View view_;
  double error_;
};

}  // namespace lazyccd::research
