// Certified signs behind continuous normal cones with the contour condition (Volino and
// Magnenat-Thalmann 1994; Tang et al. 2008): parts of a surface that cannot touch themselves during
// the step.
//
// A patch is some faces of one surface. Seen along a direction v, let all its faces have positive
// area at every time of the step, and let its boundary be one closed curve that never meets itself.
// Then the number of times that the patch covers a generic point of the plane is the winding number
// of the boundary there, 0 or 1: the view is one to one, and two points of the patch that coincide
// are the same point. The tests between primitives that share a vertex are none of the detector's.
//
// The cone of normals is kept as the set of those of 26 directions that lie in it: a few additions
// a face, one AND a node, and no angle is ever rounded.
//
// Below, a vertex is three coordinates at the start and three at the end of the step. A comparison
// with what is not a number is false, and then nothing is proved.
#pragma once

#include <cmath>
#include <cstdint>

#include "core/lane.h"
#include "core/platform.h"
#include "core/vec.h"

namespace lazyccd {

// Directions of view: the axes and diagonals of a cube, up to sign, with two more whose coordinates
// span the plane seen.
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

// Sets of directions: bit i for view i, bit 16 + i for its opposite.
using Directions = std::uint32_t;

// One of the views that a set has, either way round; -1 where it is empty.
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

// The views along which a face has positive area, or negative, all the time: its normal
// e1(t) x e2(t) is a quadratic, whose Bernstein coefficients times the direction must have one
// sign.
//
// Rounding, in units of u = 2^-53 times E1 E2, the largest components over the step: a product of
// two rounded differences 3, a component of a cross product 8, of the mean of two of them 10, the
// product with a direction 3 * 10 + 12 = 42. So 64 bounds it; 2^-1000 covers underflow.
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

// The boundary of a patch as it is seen along a view: a closed curve of vertices.
class Contour {
 public:
  // `size`: the largest magnitude of a coordinate of its vertices.
  LAZYCCD_HD Contour(const View& view, double size)
      : view_(view),
        // What is seen is a sum of at most four coordinates, in three roundings of at most 4 u
        // size.
        error_(0x1p-47 * size + 0x1p-1000) {}

  // A vertex at both ends of the step, in four directions of the plane: u, w, u + w and u - w.
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

  // A side of the curve.
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

  // Whether two sides that are not neighbours never meet: they are on the same side of each other
  // in one direction at both ends and so, the motion being linear, all the time.
  LAZYCCD_HD bool apart(const Side& a, const Side& b) const {
    for (int k = 0; k < kDirections; ++k) {
      if (a.lo[0][k] - b.hi[0][k] > error_ && a.lo[1][k] - b.hi[1][k] > error_) return true;
      if (b.lo[0][k] - a.hi[0][k] > error_ && b.lo[1][k] - a.hi[1][k] > error_) return true;
    }
    return false;
  }

  // Whether the neighbours a-b and b-c never fold onto each other: both go forward in one direction
  // all the time, or they always turn to the same side.
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
    // cross(t) is a quadratic: one sign of its Bernstein coefficients. Its factors are at most
    // `size` and off by error_ and a rounding, which is less; of four products that makes less
    // than 16.
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

}  // namespace lazyccd
