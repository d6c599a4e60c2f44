// Compares rounding errors of the elementary tests with the bounds of core/narrow/elementary.h. The
// exact values are rationals. The queries come from every generator and from a search for the worst
// error.
#include <algorithm>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <cstdio>
#include <vector>

#include "core/narrow/decision.h"
#include "support/catch.h"
#include "support/generators.h"
#include "support/test_budget.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

using Rational = boost::multiprecision::cpp_rational;
using Exact = Vec3<Rational>;

// The query as the narrow phase receives it: differences of doubles, scaled by a power of two to
// less than 2^6, in type T. Also the same values without rounding.
template <class T>
struct Case {
  Differences<T> rounded;
  Magnitudes<T> magnitudes;
  std::array<Exact, 2> e1, e2, r;
};

template <class T>
Vec3<T> narrowed(const Vec3<double>& v) {
  return {static_cast<T>(v.x), static_cast<T>(v.y), static_cast<T>(v.z)};
}

Exact exact(const std::array<double, 3>& p) {
  return {Rational(p[0]), Rational(p[1]), Rational(p[2])};
}

// Returns false if the narrow phase would not use this arithmetic for the query's range.
template <ContactKind kind, class T>
bool make_case(const QueryPoints& points, Case<T>& c) {
  QueryCoordinates q;
  for (std::size_t i = 0; i < 4; ++i) {
    q.start[i] = {points[i][0], points[i][1], points[i][2]};
    q.end[i] = {points[i + 4][0], points[i + 4][1], points[i + 4][2]};
  }
  double size = 0;
  const Differences<double> unscaled = differences<kind>(q, 1.0);
  for (const auto* v : {&unscaled.e1, &unscaled.e2, &unscaled.r}) {
    const Vec3<double> m = max_abs(*v);
    size = std::max({size, m.x, m.y, m.z});
  }
  if (!(size > 1e-280 && size < 1e280)) return false;
  const double scale = std::ldexp(1.0, 5 - std::ilogb(size));
  const Differences<double> d = differences<kind>(q, scale);
  const bool vf = kind == ContactKind::vertex_face;
  for (std::size_t end = 0; end < 2; ++end) {
    c.rounded.e1[end] = narrowed<T>(d.e1[end]);
    c.rounded.e2[end] = narrowed<T>(d.e2[end]);
    c.rounded.r[end] = narrowed<T>(d.r[end]);
    const auto way = [&](std::size_t from, std::size_t to) {
      return Rational(scale) * (exact(points[to + 4 * end]) - exact(points[from + 4 * end]));
    };
    c.e1[end] = vf ? way(1, 2) : way(0, 1);
    c.e2[end] = vf ? way(1, 3) : way(2, 3);
    c.r[end] = vf ? way(1, 0) : way(0, 2);
  }
  c.magnitudes = magnitudes(c.rounded);
  return true;
}

Exact at(const std::array<Exact, 2>& v, const Rational& t) {
  return Rational(1 - t) * v[0] + t * v[1];
}

template <class T>
double ratio(const T& computed, const Rational& exact, const T& bound) {
  return static_cast<double>(Rational(abs(Rational(computed) - exact) / Rational(bound)));
}

// Largest error over its bound of the cubic's Bernstein coefficients over [lo, hi]. The exact
// coefficients follow from values and derivatives at both ends (Hermite interpolation).
template <class T>
double cubic_ratio(const Case<T>& c, T lo, T hi) {
  const Cubic<T> whole = coplanarity(c.rounded, c.magnitudes);
  const Cubic<T> part = lo == 0 && hi == 1 ? whole : whole.on(lo, hi);
  const Exact w1 = c.e1[1] - c.e1[0], w2 = c.e2[1] - c.e2[0], wr = c.r[1] - c.r[0];
  std::array<Rational, 4> k;
  for (const bool last : {false, true}) {
    const Rational t(last ? hi : lo), third = Rational(hi) / 3 - Rational(lo) / 3;
    const Exact e1 = at(c.e1, t), e2 = at(c.e2, t), r = at(c.r, t), n = cross(e1, e2);
    const Rational f = dot(n, r), slope = dot(cross(w1, e2) + cross(e1, w2), r) + dot(n, wr);
    k[last ? 3 : 0] = f;
    k[last ? 2 : 1] = last ? Rational(f - third * slope) : Rational(f + third * slope);
  }
  double worst =
      std::max(ratio(whole.at(lo), k[0], whole.bound), ratio(whole.at(hi), k[3], whole.bound));
  for (std::size_t i = 0; i < 4; ++i) worst = std::max(worst, ratio(part.k[i], k[i], part.bound));
  return worst;
}

// The inside conditions at one time, with the operations of inside_conditions() in the same order.
template <ContactKind kind, class T>
std::array<T, 3> inside_values(const Vec3<T>& e1, const Vec3<T>& e2, const Vec3<T>& r) {
  const Vec3<T> n = cross(e1, e2);
  const Vec3<T> wv = kind == ContactKind::vertex_face ? cross(e1, r) : cross(r, e1);
  return {dot(n, n), dot(n, cross(r, e2)), dot(n, wv)};
}

template <ContactKind kind, class T>
double inside_ratio(const Case<T>& c, T t) {
  const auto computed =
      inside_values<kind, T>(lerp(c.rounded.e1, t), lerp(c.rounded.e2, t), lerp(c.rounded.r, t));
  const Rational time(t);
  const auto exact = inside_values<kind, Rational>(at(c.e1, time), at(c.e2, time), at(c.r, time));
  const Magnitudes<T>& m = c.magnitudes;
  const T u = 30 * Roundoff<T>::u, tiny = Roundoff<T>::tiny;
  const std::array<T, 3> bounds{u * dot(m.n, m.n) + tiny,
                                u * dot(m.n, cross_bound(m.r, m.e2)) + tiny,
                                u * dot(m.n, cross_bound(m.r, m.e1)) + tiny};
  double worst = 0;
  for (std::size_t i = 0; i < 3; ++i)
    worst = std::max(worst, ratio(computed[i], exact[i], bounds[i]));
  return worst;
}

// True if the claims of inside_conditions() about an interval hold at its ends, its midpoint and
// between them.
template <ContactKind kind, class T>
bool inside_is_true(const Case<T>& c, T mid, T half) {
  const Inside<T> claimed = inside_conditions<kind>(c.rounded, c.magnitudes, mid, half);
  std::array<bool, 4> always_negative{true, true, true, true};
  bool always_inside = true;
  for (int i = -4; i <= 4; ++i) {
    const Rational t = Rational(mid) + Rational(half) * i / 4;
    const auto [nn, u, v] = inside_values<kind, Rational>(at(c.e1, t), at(c.e2, t), at(c.r, t));
    const std::array<Rational, 4> conditions =
        kind == ContactKind::vertex_face ? std::array<Rational, 4>{u, v, nn - u - v, nn - u - v}
                                         : std::array<Rational, 4>{u, v, nn - u, nn - v};
    for (std::size_t j = 0; j < 4; ++j) {
      always_negative[j] = always_negative[j] && conditions[j] < 0;
      always_inside = always_inside && conditions[j] > 0;
    }
  }
  const bool one_negative = std::any_of(always_negative.begin(), always_negative.end(),
                                        [](bool negative) { return negative; });
  return (!claimed.all_positive || always_inside) && (!claimed.any_negative || one_negative);
}

// An interval that the subdivision may visit: its ends are exact in single precision.
template <class T>
std::array<T, 2> any_part(Random& r) {
  const int level = r.integer(0, 12), k = r.integer(0, (1 << level) - 1);
  return {static_cast<T>(std::ldexp(k, -level)), static_cast<T>(std::ldexp(k + 1, -level))};
}

struct Worst {
  double cubic = 0, inside = 0;
  void operator+=(const Worst& other) {
    cubic = std::max(cubic, other.cubic);
    inside = std::max(inside, other.inside);
  }
};

template <ContactKind kind, class T>
Worst measure(const QueryPoints& points, Random& r, bool& claims_hold) {
  Case<T> c;
  if (!make_case<kind>(points, c)) return {};
  const auto [lo, hi] = any_part<T>(r);
  const T half = (hi - lo) / 2;
  claims_hold = inside_is_true<kind>(c, T(lo + half), half);
  return {std::max(cubic_ratio<T>(c, 0, 1), cubic_ratio<T>(c, lo, hi)), inside_ratio<kind>(c, lo)};
}

template <class T>
Worst measure(ContactKind kind, const QueryPoints& points, Random& r, bool& claims_hold) {
  return kind == ContactKind::vertex_face
             ? measure<ContactKind::vertex_face, T>(points, r, claims_hold)
             : measure<ContactKind::edge_edge, T>(points, r, claims_hold);
}

template <class T>
void check_generators(const char* precision) {
  Worst worst;
  Random r(3);
  for (const Generator& generator : generators()) {
    for (const ContactKind kind : {ContactKind::vertex_face, ContactKind::edge_edge}) {
      for (std::uint64_t i = 0; i < (generator.share == 1 ? 4 : repetitions(40)); ++i) {
        INFO(generator.name << ", "
                            << (kind == ContactKind::vertex_face ? "vertex-face" : "edge-edge")
                            << ", number " << i);
        bool claims_hold = true;
        const Worst of_query = measure<T>(kind, generate(generator, kind, 2, i), r, claims_hold);
        if (!claims_hold) CHECK(claims_hold);
        if (!(of_query.cubic <= 1)) CHECK(of_query.cubic <= 1);
        if (!(of_query.inside <= 1)) CHECK(of_query.inside <= 1);
        worst += of_query;
      }
    }
  }
  std::printf("%s, generators: error over bound at most %.3f (cubic), %.3f (inside)\n", precision,
              worst.cubic, worst.inside);
  // If no error comes near its bound, the test has measured nothing.
  CHECK(worst.cubic > 0.05);
  CHECK(worst.inside > 0.05);
}

// Checks queries in which only some points move, for intervals anywhere in the step.
template <ContactKind kind, class T>
void check_where_some_move(Random& r) {
  for (int moving = 1; moving < 15; ++moving) {
    for (std::uint64_t i = 0; i < repetitions(60); ++i) {
      QueryPoints points;
      for (std::size_t k = 0; k < 8; ++k) {
        const bool stays = k >= 4 && (moving >> (k - 4) & 1) == 0;
        for (std::size_t x = 0; x < 3; ++x)
          points[k][x] = stays ? points[k - 4][x] : r.uniform(-1, 1);
      }
      bool claims_hold = true;
      measure<kind, T>(points, r, claims_hold);
      CAPTURE(moving, i);
      if (!claims_hold) CHECK(claims_hold);
    }
  }
}

// Hill climbing from random queries to queries with larger errors. Each step
// changes up to three coordinates, often only their last bits.
template <class T>
void check_search(const char* precision, double Worst::*what) {
  double worst = 0;
  for (std::uint64_t start = 0; start < 6; ++start) {
    Random r(start);
    const ContactKind kind = start % 2 == 0 ? ContactKind::vertex_face : ContactKind::edge_edge;
    QueryPoints best;
    for (auto& point : best)
      for (double& x : point) x = r.uniform(-1, 1);
    double best_ratio = 0;
    for (std::uint64_t step = 0; step < repetitions(300); ++step) {
      QueryPoints tried = best;
      for (int i = r.integer(1, 3); i > 0; --i) {
        double& x = tried[static_cast<std::size_t>(r.integer(0, 7))]
                         [static_cast<std::size_t>(r.integer(0, 2))];
        const double near = x + x * r.uniform(-1, 1) * std::ldexp(1.0, -r.integer(0, 53));
        x = r.chance(0.2) ? r.uniform(-1, 1) : near;
      }
      bool claims_hold = true;
      const double found = measure<T>(kind, tried, r, claims_hold).*what;
      if (!claims_hold) CHECK(claims_hold);
      if (found > best_ratio) {
        best_ratio = found;
        best = tried;
      }
    }
    worst = std::max(worst, best_ratio);
  }
  std::printf("%s, search: error over bound at most %.3f\n", precision, worst);
  CHECK(worst <= 1);
}

}  // namespace

TEST_CASE("no generated query has an error beyond the bounds of single precision") {
  check_generators<float>("single");
}

TEST_CASE("no generated query has an error beyond the bounds of double precision") {
  check_generators<double>("double");
}

TEST_CASE("a search for the worst error of the cubic finds none beyond its bound") {
  check_search<float>("single, cubic", &Worst::cubic);
  check_search<double>("double, cubic", &Worst::cubic);
}

TEST_CASE("a search for the worst error of the inside conditions finds none beyond their bounds") {
  check_search<float>("single, inside", &Worst::inside);
  check_search<double>("double, inside", &Worst::inside);
}

TEST_CASE("claims about a part of a step hold whichever points move") {
  Random r(11);
  check_where_some_move<ContactKind::vertex_face, float>(r);
  check_where_some_move<ContactKind::vertex_face, double>(r);
  check_where_some_move<ContactKind::edge_edge, float>(r);
  check_where_some_move<ContactKind::edge_edge, double>(r);
  SUCCEED();
}
