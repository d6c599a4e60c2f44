// Tests of the minimum separation. Compares the elementary tests with distances in extended
// precision, and whole detections with the elementary tests.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/narrow/closest.h"
#include "core/narrow/separation.h"
#include "lazyccd/detector.h"
#include "lazyccd/error.h"
#include "lazyccd/query.h"
#include "support/catch.h"
#include "support/generators.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

constexpr double time_unit = 0x1p-32;
using LongPoint = std::array<long double, 3>;

LongPoint operator-(const LongPoint& a, const LongPoint& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
long double dot(const LongPoint& a, const LongPoint& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
LongPoint along(const LongPoint& a, const LongPoint& d, long double t) {
  return {a[0] + t * d[0], a[1] + t * d[1], a[2] + t * d[2]};
}
long double clamped(long double x) { return x > 0 ? (x < 1 ? x : 1) : 0; }

long double squared_point_segment(const LongPoint& p, const LongPoint& a, const LongPoint& b) {
  const LongPoint ab = b - a;
  const long double size = dot(ab, ab);
  const LongPoint q = along(a, ab, size > 0 ? clamped(dot(p - a, ab) / size) : 0);
  return dot(p - q, p - q);
}

// Distance of the primitives by brute force over all features: interiors, if the projections fall
// inside, and all vertices and edges.
long double distance(ContactKind kind, const std::array<LongPoint, 4>& x) {
  long double least = std::numeric_limits<long double>::infinity();
  const auto consider = [&](long double squared) { least = std::fmin(least, squared); };
  if (kind == ContactKind::vertex_face) {
    const LongPoint e1 = x[2] - x[1], e2 = x[3] - x[1], r = x[0] - x[1];
    const long double a = dot(e1, e1), b = dot(e1, e2), c = dot(e2, e2);
    const long double det = a * c - b * b;
    const long double u = (c * dot(e1, r) - b * dot(e2, r)) / det;
    const long double v = (a * dot(e2, r) - b * dot(e1, r)) / det;
    if (det > 0 && u >= 0 && v >= 0 && u + v <= 1) {
      const LongPoint gap = along(along(r, e1, -u), e2, -v);
      consider(dot(gap, gap));
    }
    for (const auto& [i, j] : {std::pair(1, 2), {2, 3}, {3, 1}})
      consider(squared_point_segment(x[0], x[i], x[j]));
  } else {
    const LongPoint e1 = x[1] - x[0], e2 = x[3] - x[2], r = x[2] - x[0];
    const long double a = dot(e1, e1), b = dot(e1, e2), c = dot(e2, e2);
    const long double det = a * c - b * b;
    const long double u = (c * dot(e1, r) - b * dot(e2, r)) / det;
    const long double v = (b * dot(e1, r) - a * dot(e2, r)) / det;
    if (det > 0 && u >= 0 && u <= 1 && v >= 0 && v <= 1) {
      const LongPoint gap = along(along(r, e1, -u), e2, v);
      consider(dot(gap, gap));
    }
    for (const auto& [p, i, j] : {std::array{0, 2, 3}, {1, 2, 3}, {2, 0, 1}, {3, 0, 1}})
      consider(squared_point_segment(x[p], x[i], x[j]));
  }
  return std::sqrt(least);
}

long double distance_at(ContactKind kind, const QueryPoints& q, long double t) {
  std::array<LongPoint, 4> x;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t k = 0; k < 3; ++k)
      x[i][k] =
          (1 - t) * static_cast<long double>(q[i][k]) + t * static_cast<long double>(q[i + 4][k]);
  return distance(kind, x);
}

double size_of(const QueryPoints& q) {
  double size = 0;
  for (std::size_t i = 0; i < 8; ++i)
    for (std::size_t k = 0; k < 3; ++k) size = std::fmax(size, std::fabs(q[i][k] - q[0][k]));
  return size;
}

QueryPoints falling_vertex(double from, double to) {
  return {{{0.25, from, 0.25},
           {0, 0, 0},
           {1, 0, 0},
           {0, 0, 1},
           {0.25, to, 0.25},
           {0, 0, 0},
           {1, 0, 0},
           {0, 0, 1}}};
}

}  // namespace

TEST_CASE("a falling vertex is in contact when it is as near as the separation") {
  const ContactKind vf = ContactKind::vertex_face;
  const QueryResult result = decide_within(vf, falling_vertex(1, 0.125), 0.25);
  REQUIRE(result.hit);
  CHECK(result.toi <= 0.75 / 0.875);
  CHECK(result.toi > 0.75 / 0.875 - 3 * time_unit);
  CHECK_FALSE(decide_within(vf, falling_vertex(1, 0.26), 0.25).hit);
  CHECK_FALSE(decide_within(vf, falling_vertex(1, 0.25000001), 0.25).hit);
  CHECK(decide_within(vf, falling_vertex(1, 0.25), 0.25).hit);
}

// If primitives rotate, a separating axis of one time separates them for a short time only.
TEST_CASE("a rotating face reaches a vertex within a few advances") {
  constexpr double h = 0.25;
  int most = 0;
  for (int tilt = -7; tilt <= 7; ++tilt) {
    const double rise = 0.1 * tilt;
    const QueryPoints points{{{0.25, 1, 0.25},
                              {0, 0, 0},
                              {1, 0, 0},
                              {0, 0, 1},
                              {0.25, 0.1, 0.25},
                              {0, 0, 0},
                              {1, rise, 0},
                              {0, -0.5 * rise, 1}}};
    QueryCoordinates q;
    for (std::size_t p = 0; p < 4; ++p) {
      q.start[p] = {points[p][0], points[p][1], points[p][2]};
      q.end[p] = {points[p + 4][0], points[p + 4][1], points[p + 4][2]};
    }
    const Differences<double> d = differences<ContactKind::vertex_face>(q, 1);
    const Magnitudes<double> m = magnitudes(d);
    Search<double> search;
    int advances = 0;
    Advanced<double> advanced{false, false};
    while (!advanced.arrived && !advanced.missed && advances < kMaxAdvances) {
      advanced = advance<ContactKind::vertex_face>(d, m, h, search);
      ++advances;
    }
    REQUIRE(advanced.arrived);
    CHECK(distance_at(ContactKind::vertex_face, points, search.t) >= h);
    CHECK(distance_at(ContactKind::vertex_face, points, search.t + 1e-8) < h);
    most = std::max(most, advances);
  }
  CHECK(most <= 8);
}

TEST_CASE("primitives nearer than the separation at the start are in contact at time zero") {
  const QueryResult result = decide_within(ContactKind::vertex_face, falling_vertex(0.1, 3), 0.25);
  CHECK(result.hit);
  CHECK(result.toi == 0);
}

TEST_CASE("a separation of zero is the exact decision") {
  for (const Generator& generator : generators()) {
    if (generator.share == 1) continue;  // slow
    for (std::uint64_t i = 0; i < 20; ++i) {
      const QueryPoints q = generate(generator, ContactKind::edge_edge, 3, i);
      const QueryResult a = decide(ContactKind::edge_edge, q);
      const QueryResult b = decide_within(ContactKind::edge_edge, q, 0);
      CHECK((a.hit == b.hit && (!a.hit || a.toi == b.toi)));
    }
  }
}

TEST_CASE("a separation that is negative or not a number is refused") {
  const QueryPoints q = falling_vertex(1, 0);
  for (const double bad : {-1.0, std::nan(""), HUGE_VAL}) {
    CHECK_THROWS_AS(decide_within(ContactKind::vertex_face, q, bad), Error);
    DetectorOptions options;
    options.separation = bad;
    CHECK_THROWS_AS(Detector(options), Error);
  }
}

TEST_CASE("no query that comes within the separation is missed, none found late or far") {
  int hits = 0, misses = 0;
  for (const Generator& generator : generators()) {
    for (const ContactKind kind : {ContactKind::vertex_face, ContactKind::edge_edge}) {
      for (std::uint64_t i = 0; i < 40; ++i) {
        const QueryPoints q = generate(generator, kind, 11, i);
        const double size = size_of(q);
        if (!(size > 1e-100 && size < 1e100)) continue;
        for (const double part : {1e-6, 1e-2, 0.3}) {
          const double h = part * size;
          const QueryResult result = decide_within(kind, q, h);
          const double until = result.hit ? result.toi : 1;
          bool missed = false;
          constexpr int samples = 64;
          for (int s = 0; s <= samples; ++s) {
            const double t = until * s / samples;
            const bool inside = t < until || !result.hit;
            missed = missed || (inside && distance_at(kind, q, t) < h * (1 - 1e-12));
          }
          bool far = false;
          if (result.hit) far = distance_at(kind, q, result.toi + time_unit) > h + 1e-6 * size;
          if (missed || far) {
            INFO(generator.name << ", number " << i << ", part " << part);
            CHECK_FALSE(missed);
            CHECK_FALSE(far);
          }
          (result.hit ? hits : misses) += 1;
        }
      }
    }
  }
  CHECK(hits > 1000);
  CHECK(misses > 300);
}
