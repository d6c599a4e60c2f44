#include "support/generators.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string_view>

namespace lazyccd::test {

std::uint64_t Random::bits() {
  std::uint64_t z = state_ += 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

int Random::integer(int lo, int hi) {
  return lo + static_cast<int>(bits() % static_cast<std::uint64_t>(hi - lo + 1));
}

double Random::uniform(double lo, double hi) {
  return lo + (hi - lo) * (static_cast<double>(bits() >> 11) * 0x1p-53);
}

namespace {

using Point = std::array<double, 3>;
using Points = std::array<Point, 4>;  // at one instant

// Never draw two numbers in the arguments of one call: the order of evaluation depends on the
// compiler.

std::size_t index(int i) { return static_cast<std::size_t>(i); }

Point operator+(const Point& a, const Point& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
Point operator-(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Point operator*(double s, const Point& a) { return {s * a[0], s * a[1], s * a[2]}; }
double dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Point coarse_point(Random& r) { return {r.coarse(), r.coarse(), r.coarse()}; }
Point uniform_point(Random& r) { return {r.uniform(-1, 1), r.uniform(-1, 1), r.uniform(-1, 1)}; }
using AnyPoint = Point (*)(Random&);

// A time, or a position along an edge, for which sums with coarse numbers stay exact.
double sixteenth(Random& r, int lo = 0, int hi = 16) { return r.integer(lo, hi) / 16.0; }

// Four points of two primitives that touch at the parameters u, v (see Contact).
Points touching(ContactKind kind, double u, double v, AnyPoint point, Random& r) {
  const Point a = point(r), b = point(r), c = point(r);
  if (kind == ContactKind::vertex_face) return {a + u * (b - a) + v * (c - a), a, b, c};
  const Point x = a + u * (b - a);
  return {a, b, x - v * c, x + (1 - v) * c};
}

// Each point moves along its own random direction and is at its given place at time t.
QueryPoints through(const Points& places, double t, AnyPoint way, Random& r) {
  QueryPoints q;
  for (std::size_t i = 0; i < 4; ++i) {
    const Point w = way(r);
    q[i] = places[i] - t * w;
    q[i + 4] = places[i] + (1 - t) * w;
  }
  return q;
}

template <class Map>
QueryPoints mapped(QueryPoints q, const Map& map) {
  for (Point& p : q) p = map(p);
  return q;
}

// The same four motions with the points renamed: the face's vertices rotated, or ends of an edge or
// the edges swapped.
QueryPoints relabelled(ContactKind kind, const QueryPoints& q, Random& r) {
  std::array<std::size_t, 4> order{0, 1, 2, 3};
  if (kind == ContactKind::vertex_face) {
    for (int i = 3; i > 1; --i) std::swap(order[index(i)], order[index(r.integer(1, i))]);
  } else {
    if (r.chance(0.5)) std::swap(order[0], order[1]);
    if (r.chance(0.5)) std::swap(order[2], order[3]);
    if (r.chance(0.5)) std::swap(order[0], order[2]), std::swap(order[1], order[3]);
  }
  QueryPoints s;
  for (std::size_t i = 0; i < 4; ++i) s[i] = q[order[i]], s[i + 4] = q[order[i] + 4];
  return s;
}

// Multiplies all points by a random matrix of small integers, which may be singular. The result is
// exact, and coplanar points stay coplanar.
QueryPoints tilted(const QueryPoints& q, Random& r) {
  std::array<Point, 3> rows;
  for (Point& row : rows)
    for (double& x : row) x = r.integer(-2, 2);
  const Point shift = coarse_point(r);
  return mapped(q, [&](const Point& p) {
    return shift + Point{dot(rows[0], p), dot(rows[1], p), dot(rows[2], p)};
  });
}

double one_ulp_off(double x, Random& r) {
  const double infinity = std::numeric_limits<double>::infinity();
  return std::nextafter(x, r.chance(0.5) ? infinity : -infinity);
}

double& any_coordinate(QueryPoints& q, Random& r) {
  Point& p = q[index(r.integer(0, 7))];
  return p[index(r.integer(0, 2))];
}

QueryPoints random(ContactKind, Random& r) {
  QueryPoints q;
  for (Point& p : q) p = uniform_point(r);
  return q;
}

QueryPoints aimed(ContactKind kind, Random& r) {
  double u = r.uniform(0, 1), v = r.uniform(0, 1);
  if (kind == ContactKind::vertex_face && u + v > 1) u = 1 - u, v = 1 - v;
  const Points at = touching(kind, u, v, uniform_point, r);
  const double t = r.uniform(0, 1);
  return through(at, t, uniform_point, r);
}

QueryPoints passing(ContactKind kind, Random& r) {
  const double u = r.uniform(-0.5, 1.5), v = r.uniform(-0.5, 1.5);
  const Points at = touching(kind, u, v, uniform_point, r);
  const double t = r.uniform(0, 1);
  return through(at, t, uniform_point, r);
}

QueryPoints near_contact(ContactKind kind, Random& r) {
  return r.chance(0.5) ? aimed(kind, r) : passing(kind, r);
}

QueryPoints boundary(ContactKind kind, Random& r) {
  const double u = r.chance(0.5) ? 0 : r.uniform(0, 1);
  const Points at = touching(kind, u, 0, uniform_point, r);
  const double t = r.uniform(0, 1);
  return through(at, t, uniform_point, r);
}

QueryPoints as_float(ContactKind kind, Random& r) {
  return mapped(near_contact(kind, r), [](const Point& p) {
    Point f;
    for (std::size_t i = 0; i < 3; ++i) f[i] = static_cast<double>(static_cast<float>(p[i]));
    return f;
  });
}

QueryPoints sliver(ContactKind kind, Random& r) {
  const double thin = std::pow(10.0, r.uniform(-12, -3));
  return mapped(aimed(kind, r), [&](const Point& p) {
    return Point{p[0] + p[1], p[0] + p[1] + thin * p[2], p[0] + thin * p[1]};
  });
}

QueryPoints rotation(ContactKind kind, Random& r) {
  const double u = r.uniform(0, 0.5), v = r.uniform(0, 0.5);
  const Points at = touching(kind, u, v, uniform_point, r);
  const auto split = static_cast<std::size_t>(first_vertex_of_b(kind));
  QueryPoints q;
  Point axis, shift;
  double from = 0, to = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    if (i == 0 || i == split) {
      axis = uniform_point(r);
      axis = (1 / std::sqrt(dot(axis, axis))) * axis;
      shift = 0.1 * uniform_point(r);
      from = r.uniform(-2, 0);
      to = r.uniform(0, 2);
    }
    const auto turned = [&](double angle) {
      const double c = std::cos(angle), s = std::sin(angle);
      return c * at[i] + s * cross(axis, at[i]) + ((1 - c) * dot(axis, at[i])) * axis;
    };
    q[i] = turned(from) - shift;
    q[i + 4] = turned(to) + shift;
  }
  return q;
}

QueryPoints far_away(ContactKind kind, Random& r) {
  const double distance = std::pow(10.0, r.uniform(2, 9));
  const Point shift = distance * uniform_point(r);
  return mapped(near_contact(kind, r), [&](const Point& p) { return shift + p; });
}

QueryPoints scaled(ContactKind kind, Random& r) {
  const double scale = std::pow(10.0, r.uniform(-6, 6));
  return mapped(near_contact(kind, r), [&](const Point& p) { return scale * p; });
}

QueryPoints stretched(ContactKind kind, Random& r) {
  const Point scale{std::pow(10.0, r.uniform(-8, 8)), 1, std::pow(10.0, r.uniform(-8, 8))};
  return mapped(near_contact(kind, r), [&](const Point& p) {
    return Point{scale[0] * p[0], scale[1] * p[1], scale[2] * p[2]};
  });
}

QueryPoints huge(ContactKind kind, Random& r) {
  const double scale = std::pow(10.0, r.uniform(100, 307.5));
  return mapped(aimed(kind, r), [&](const Point& p) { return (0.05 * scale) * p; });
}

QueryPoints tiny(ContactKind kind, Random& r) {
  const double scale = std::pow(10.0, r.uniform(-300, -100));
  return mapped(aimed(kind, r), [&](const Point& p) { return scale * p; });
}

// Points in contact, and a motion for which f and its derivative vanish together, up to rounding.
QueryPoints close_roots(ContactKind kind, Random& r) {
  const double u = r.uniform(0.1, 0.45), v = r.uniform(0.1, 0.45);
  const Points at = touching(kind, u, v, uniform_point, r);
  Points way;
  for (Point& w : way) w = uniform_point(r);
  const double t = r.uniform(0, 1);
  const bool vf = kind == ContactKind::vertex_face;
  const auto differences = [&](const Points& x) {
    return vf ? std::array<Point, 3>{x[2] - x[1], x[3] - x[1], x[0] - x[1]}
              : std::array<Point, 3>{x[1] - x[0], x[3] - x[2], x[2] - x[0]};
  };
  const auto [e1, e2, d] = differences(at);
  const auto [w1, w2, wd] = differences(way);
  const Point n = cross(e1, e2);
  const double slope = dot(cross(w1, e2) + cross(e1, w2), d) + dot(n, wd);
  const Point correction = (-slope / dot(n, n)) * n;
  for (std::size_t i : vf ? std::vector<std::size_t>{0} : std::vector<std::size_t>{2, 3})
    way[i] = way[i] + correction;
  QueryPoints q;
  for (std::size_t i = 0; i < 4; ++i) {
    q[i] = at[i] - t * way[i];
    q[i + 4] = at[i] + (1 - t) * way[i];
  }
  return q;
}

// As close_roots(), but exact: f = c (t - t0)^2. With s = t - t0, e1 = (1, 0, k s), e2 = (0, 1, 0)
// and r_z = s r_z', f = s (r_z' - k r_x(t0)) - k r_x' s^2. The first term is made zero.
QueryPoints tangent(ContactKind kind, Random& r) {
  const bool vf = kind == ContactKind::vertex_face;
  const double t0 = sixteenth(r), k = r.integer(-3, 3);
  const double x = sixteenth(r, -2, 16), y = sixteenth(r, -2, 16), x_way = r.integer(-2, 2);
  QueryPoints q;
  for (std::size_t end = 0; end < 2; ++end) {
    const double s = static_cast<double>(end) - t0;
    const Point e1{1, 0, k * s}, e2{0, 1, 0}, d{x + x_way * s, vf ? y : -y, k * x * s};
    const Points p = vf ? Points{d, {}, e1, e2} : Points{Point{}, e1, d, d + e2};
    for (std::size_t i = 0; i < 4; ++i) q[4 * end + i] = p[i];
  }
  return tilted(q, r);
}

Points touching_inside(ContactKind kind, Random& r) {
  const int u = r.integer(1, 14);
  const int v = r.integer(1, kind == ContactKind::vertex_face ? 15 - u : 15);
  return touching(kind, u / 16.0, v / 16.0, coarse_point, r);
}

Points touching_edge(ContactKind kind, Random& r) {
  const double u = sixteenth(r);
  return touching(kind, u, 0, coarse_point, r);
}

Points touching_vertex(ContactKind kind, Random& r) {
  return touching(kind, 0, 0, coarse_point, r);
}

Points touching_anyhow(ContactKind kind, Random& r) {
  switch (r.integer(0, 2)) {
    case 0:
      return touching_inside(kind, r);
    case 1:
      return touching_edge(kind, r);
    default:
      return touching_vertex(kind, r);
  }
}

// As through(), at a multiple of a sixteenth of the step.
QueryPoints through_coarsely(const Points& at, AnyPoint way, Random& r) {
  const double t = sixteenth(r);
  return through(at, t, way, r);
}

QueryPoints touch_inside(ContactKind kind, Random& r) {
  return through_coarsely(touching_inside(kind, r), coarse_point, r);
}

QueryPoints touch_edge(ContactKind kind, Random& r) {
  return through_coarsely(touching_edge(kind, r), coarse_point, r);
}

QueryPoints touch_vertex(ContactKind kind, Random& r) {
  return through_coarsely(touching_vertex(kind, r), coarse_point, r);
}

QueryPoints touch_start(ContactKind kind, Random& r) {
  return through(touching_anyhow(kind, r), 0, coarse_point, r);
}
QueryPoints touch_end(ContactKind kind, Random& r) {
  return through(touching_anyhow(kind, r), 1, coarse_point, r);
}

QueryPoints one_ulp(ContactKind kind, Random& r) {
  QueryPoints q = through_coarsely(touching_anyhow(kind, r), coarse_point, r);
  for (int i = r.integer(1, 3); i > 0; --i) {
    double& x = any_coordinate(q, r);
    x = one_ulp_off(x, r);
  }
  return q;
}

Point flat_point(Random& r) { return {r.coarse(), r.coarse(), 0}; }

QueryPoints coplanar(ContactKind kind, Random& r) {
  const int u = r.integer(0, 16), v = r.integer(0, 16 - u);
  const Points at = touching(kind, u / 16.0, v / 16.0, flat_point, r);
  const double t = r.chance(0.3) ? 1 : sixteenth(r);
  QueryPoints q = through(at, t, flat_point, r);
  if (r.chance(0.4)) q[0][0] += 1.5, q[4][0] += 1.5;
  return tilted(q, r);
}

// All points on one line at all times.
QueryPoints collinear(ContactKind, Random& r) {
  const auto point = [](Random& s) { return Point{s.coarse(), 0, 0}; };
  QueryPoints q;
  for (Point& p : q) p = point(r);
  return tilted(q, r);
}

// Edges that stay parallel, or a vertex whose distance from the plane of the face stays constant.
QueryPoints parallel(ContactKind kind, Random& r) {
  const Point shape = coarse_point(r), other = coarse_point(r);
  const double distance = r.chance(0.7) ? 0 : r.coarse();
  QueryPoints q;
  Point from = coarse_point(r);
  const double ratio = r.integer(-2, 2) / 2.0;
  for (std::size_t end = 0; end < 2; ++end, from = coarse_point(r)) {
    const double along = sixteenth(r, -16, 24), across = sixteenth(r, -16, 24);
    Points p;
    if (kind == ContactKind::vertex_face) {
      const Point foot = from + along * shape + across * other;
      p = {foot + distance * cross(shape, other), from, from + shape, from + other};
    } else {
      const Point edge = end == 0 || r.chance(0.5) ? shape : 0.5 * shape;
      const Point first = from + along * shape + distance * other;
      p = {from, from + edge, first, first + ratio * edge};
    }
    for (std::size_t i = 0; i < 4; ++i) q[4 * end + i] = p[i];
  }
  return q;
}

// Faces of zero area and edges of zero length, at all times.
QueryPoints zero_area(ContactKind kind, Random& r) {
  const double u = r.chance(0.3) ? 0 : sixteenth(r), v = sixteenth(r);
  QueryPoints q = through_coarsely(touching(kind, u, 0, coarse_point, r), coarse_point, r);
  const bool vf = kind == ContactKind::vertex_face;
  const int shape = r.integer(0, 2);
  for (std::size_t end = 0; end < 8; end += 4) {
    Point* p = &q[end];
    p[3] = p[2];                                            // two vertices in one; edge b a point
    if (vf && shape == 0) p[3] = p[1] + v * (p[2] - p[1]);  // three on a line that rotates
    if (shape == 1) p[1] = vf ? p[2] : p[0];                // all in one; both edges points
  }
  return q;
}

// The normal vanishes at the time of contact only.
QueryPoints collapsing(ContactKind kind, Random& r) {
  const Point a = coarse_point(r), d = coarse_point(r);
  Points at;
  for (Point& p : at) p = a + sixteenth(r, -8, 8) * d;
  if (r.chance(0.3)) at[3] = at[2];
  if (r.chance(0.2)) at[1] = at[0];
  if (kind == ContactKind::vertex_face && r.chance(0.2)) at[1] = at[2];
  return through_coarsely(at, coarse_point, r);
}

QueryPoints zero_motion(ContactKind kind, Random& r) {
  Points at = touching_anyhow(kind, r);
  if (r.chance(0.3)) at[3] = coarse_point(r);
  QueryPoints q;
  for (std::size_t i = 0; i < 4; ++i) q[i] = q[i + 4] = at[i];
  if (r.chance(0.3)) q[0] = q[4] = {q[0][0], q[0][1], one_ulp_off(q[0][2], r)};
  return q;
}

QueryPoints translation(ContactKind kind, Random& r) {
  QueryPoints q = zero_motion(kind, r);
  const Point way = coarse_point(r);
  for (std::size_t i = 4; i < 8; ++i) q[i] = q[i] + way;
  return q;
}

// All points meet in one point at half of the step.
QueryPoints half_turn(ContactKind, Random& r) {
  QueryPoints q;
  for (std::size_t i = 0; i < 4; ++i) {
    q[i] = uniform_point(r);
    q[i + 4] = -1.0 * q[i];
  }
  if (r.chance(0.5)) {
    double& x = any_coordinate(q, r);
    x = one_ulp_off(x, r);
  }
  return q;
}

template <int size>
QueryPoints grid(ContactKind, Random& r) {
  QueryPoints q;
  for (Point& p : q)
    for (double& x : p) x = r.integer(0, size - 1);
  return q;
}

QueryPoints shared(ContactKind kind, Random& r) {
  QueryPoints q = r.chance(0.5) ? aimed(kind, r) : touch_edge(kind, r);
  for (int i = r.integer(1, 3); i > 0; --i) {
    const Point p = q[index(r.integer(0, 7))];
    q[index(r.integer(0, 7))] = p;
  }
  return q;
}

QueryPoints subnormal(ContactKind kind, Random& r) {
  const double scale = std::ldexp(1.0, r.integer(-1073, -1040));
  const QueryPoints q = r.chance(0.5) ? aimed(kind, r) : touch_edge(kind, r);
  return mapped(q, [&](const Point& p) { return scale * p; });
}

// Numbers of all magnitudes and their neighbours, with both signs and zeros.
QueryPoints any_bits(ContactKind, Random& r) {
  QueryPoints q;
  const bool from_pool = r.chance(0.5);
  double pool[4];
  const auto any = [&] {
    for (;;) {
      const std::uint64_t bits = r.bits();
      double x;
      std::memcpy(&x, &bits, sizeof x);
      if (std::isfinite(x)) return r.chance(0.1) ? 0 : x;
    }
  };
  for (double& x : pool) x = any();
  for (Point& p : q)
    for (double& x : p) {
      x = from_pool ? pool[r.integer(0, 3)] : any();
      if (r.chance(0.2)) x = one_ulp_off(x, r);
      if (r.chance(0.2)) x = -x;
      if (!std::isfinite(x)) x = std::numeric_limits<double>::max();
    }
  return q;
}

}  // namespace

const std::vector<Generator>& generators() {
  static const std::vector<Generator> all = {
      {"random", "eight points in a cube", false, 10, random},
      {"aimed", "in contact at some time, but for rounding", false, 10, aimed},
      {"passing", "coplanar at some time, near or in contact", false, 10, passing},
      {"boundary", "aimed at a side or a corner, but for rounding", false, 10, boundary},
      {"float", "coordinates that are floats", false, 10, as_float},
      {"sliver", "thin and long, nearly parallel", false, 10, sliver},
      {"rotation", "both primitives rotate rigidly", false, 10, rotation},
      {"far_away", "1e2 to 1e9 from the origin", false, 10, far_away},
      {"scaled", "1e-6 to 1e6", false, 10, scaled},
      {"stretched", "axes of different scales, 1e-8 to 1e8", false, 10, stretched},
      {"huge", "1e100 to 1e307", false, 10, huge},
      {"tiny", "1e-300 to 1e-100", false, 10, tiny},
      {"close_roots", "tangential, but for rounding: two close roots or none", false, 10,
       close_roots},
      {"tangent", "a double root exactly", true, 10, tangent},
      {"touch_inside", "inside a face, or edges that cross, exactly", true, 10, touch_inside},
      {"touch_edge", "exactly on a side, or an edge's end", true, 10, touch_edge},
      {"touch_vertex", "vertex on vertex", true, 10, touch_vertex},
      {"touch_start", "touching as the step starts", true, 10, touch_start},
      {"touch_end", "touching as the step ends", true, 10, touch_end},
      {"one_ulp", "touching but for the last bit of up to three coordinates", true, 10, one_ulp},
      {"coplanar", "in one plane at all times", true, 10, coplanar},
      {"collinear", "on one line at all times", true, 10, collinear},
      {"parallel", "edges that stay parallel; a vertex that slides along a face", true, 10,
       parallel},
      {"zero_area", "faces without area, edges without length", true, 10, zero_area},
      {"collapsing", "the normal vanishes at one time", true, 10, collapsing},
      {"zero_motion", "at rest, touching or not", true, 10, zero_motion},
      {"translation", "both at rest relative to each other", true, 10, translation},
      {"half_turn", "all points meet half way", true, 10, half_turn},
      {"grid3", "integers 0 to 2", true, 10, grid<3>},
      {"grid7", "integers 0 to 6", true, 10, grid<7>},
      {"shared", "some of the eight points equal", true, 10, shared},
      {"subnormal", "touching among the smallest numbers", true, 10, subnormal},
      {"any_bits", "any finite numbers", true, 1, any_bits},
  };
  return all;
}

QueryPoints generate(const Generator& generator, ContactKind kind, std::uint64_t seed,
                     std::uint64_t number) {
  Random mix(seed);
  std::uint64_t state = mix.bits() + number;
  for (const char c : std::string_view(generator.name))
    state = Random(state ^ static_cast<unsigned char>(c)).bits();
  Random r(state + static_cast<std::uint64_t>(kind));
  return relabelled(kind, generator.make(kind, r), r);
}

}  // namespace lazyccd::test
