// The usual test by a cubic polynomial and Newton's method with bisection; see peer.h.
#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/peers/peer.h"
#include "bench/peers/vec3.h"

namespace lazyccd::peers {
namespace {

// A cubic in power basis: p(t) = k[0] + k[1] t + k[2] t^2 + k[3] t^3.
template <class Real>
struct Cubic {
  Real k[4];
  Real value(Real t) const { return ((k[3] * t + k[2]) * t + k[1]) * t + k[0]; }
  Real slope(Real t) const { return (3 * k[3] * t + 2 * k[2]) * t + k[1]; }
};

// Returns the triple product as a cubic in time. It is zero if the four points are coplanar.
template <class Real>
Cubic<Real> coplanarity(const Frame<Real>& f) {
  const Vec3<Real> da = f.a[1] - f.a[0], db = f.b[1] - f.b[0], dc = f.c[1] - f.c[0];
  const Vec3<Real> n0 = cross(f.a[0], f.b[0]);
  const Vec3<Real> n1 = cross(da, f.b[0]) + cross(f.a[0], db);
  const Vec3<Real> n2 = cross(da, db);
  return {
      {dot(n0, f.c[0]), dot(n1, f.c[0]) + dot(n0, dc), dot(n2, f.c[0]) + dot(n1, dc), dot(n2, dc)}};
}

// Returns a root between `low` and `high`, at which the signs of p differ. Newton-Raphson that
// takes a bisection step if a Newton step would leave the bracket or shrinks it too slowly (Press
// et al., Numerical Recipes, section 9.4).
template <class Real>
Real root_in(const Cubic<Real>& p, Real low, Real high) {
  constexpr Real accuracy = 4 * std::numeric_limits<Real>::epsilon();
  if (p.value(low) > 0) std::swap(low, high);  // p(low) <= 0 from here on
  Real t = (low + high) / 2;
  Real step_before = std::abs(high - low), step = step_before;
  Real value = p.value(t), slope = p.slope(t);
  for (int i = 0; i < 100; ++i) {
    const bool leaves = ((t - high) * slope - value) * ((t - low) * slope - value) > 0;
    const bool too_slow = std::abs(2 * value) > std::abs(step_before * slope);
    step_before = step;
    if (leaves || too_slow) {
      step = (high - low) / 2;
      t = low + step;
    } else {
      step = value / slope;
      t -= step;
    }
    if (std::abs(step) < accuracy) break;
    value = p.value(t);
    slope = p.slope(t);
    (value < 0 ? low : high) = t;
  }
  return t;
}

// Finds the roots in [0, 1] in ascending order: one in each monotone interval whose ends differ in
// sign.
template <class Real>
int roots(const Cubic<Real>& p, Real (&found)[3]) {
  Real cut[4] = {0};
  int pieces = 1;
  const Real a = 3 * p.k[3], b = p.k[2], c = p.k[1];  // p' = a t^2 + 2 b t + c
  const Real discriminant = b * b - a * c;
  if (discriminant > 0) {
    const Real q = -(b + std::copysign(std::sqrt(discriminant), b));
    Real s[2] = {a != 0 ? q / a : Real(-1), q != 0 ? c / q : Real(-1)};
    if (s[0] > s[1]) std::swap(s[0], s[1]);
    for (Real t : s)
      if (t > 0 && t < 1) cut[pieces++] = t;
  }
  cut[pieces] = 1;
  int count = 0;
  for (int i = 0; i < pieces; ++i) {
    const Real v0 = p.value(cut[i]), v1 = p.value(cut[i + 1]);
    if (v0 == 0)
      found[count++] = cut[i];
    else if ((v0 < 0) != (v1 < 0) || v1 == 0)
      found[count++] = v1 == 0 ? cut[i + 1] : root_in(p, cut[i], cut[i + 1]);
  }
  return count;
}

// Returns true if the primitives touch at the time t, at which they are coplanar. Their parameters
// may be outside by a relative epsilon, as is usual, because rounding may move a point across a
// border.
template <class Real>
bool inside(ContactKind kind, const Frame<Real>& f, Real t) {
  const Real slack = std::is_same_v<Real, float> ? Real(1e-5) : Real(1e-8);
  const Vec3<Real> a = (1 - t) * f.a[0] + t * f.a[1];
  const Vec3<Real> b = (1 - t) * f.b[0] + t * f.b[1];
  const Vec3<Real> c = (1 - t) * f.c[0] + t * f.c[1];
  const Real aa = dot(a, a), ab = dot(a, b), bb = dot(b, b), ac = dot(a, c), bc = dot(b, c);
  const Real determinant = aa * bb - ab * ab;
  if (!(determinant > std::numeric_limits<Real>::epsilon() * aa * bb)) return false;  // degenerate
  if (kind == ContactKind::vertex_face) {
    const Real u = (bb * ac - ab * bc) / determinant, v = (aa * bc - ab * ac) / determinant;
    return u >= -slack && v >= -slack && u + v <= 1 + slack;
  }
  // The lines cross at u a = c + v b.
  const Real u = (bb * ac - ab * bc) / determinant, v = (ab * ac - aa * bc) / determinant;
  return u >= -slack && u <= 1 + slack && v >= -slack && v <= 1 + slack;
}

}  // namespace

template <class Real>
QueryResult cubic_newton(ContactKind kind, const QueryPoints& points) {
  const Frame<Real> f = frame(kind, rounded<Real>(points));
  Real t[3];
  const int count = roots(coplanarity(f), t);
  for (int i = 0; i < count; ++i)
    if (inside(kind, f, t[i])) return {true, double(t[i])};
  return {};
}

template QueryResult cubic_newton<float>(ContactKind, const QueryPoints&);
template QueryResult cubic_newton<double>(ContactKind, const QueryPoints&);

}  // namespace lazyccd::peers
