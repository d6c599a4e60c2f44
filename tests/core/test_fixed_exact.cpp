// The exact stage with integers of fixed width, which the device runs too, against that with
// integers of any size and against the oracle.
#include <cmath>
#include <random>

#include "core/exact/decide.h"
#include "core/exact/fixed_integer.h"
#include "cpu/narrow/exact.h"
#include "support/catch.h"
#include "support/generators.h"
#include "support/test_budget.h"

using namespace lazyccd;
using namespace lazyccd::test;
using exact::FixedInteger;

namespace {

QueryCoordinates coordinates(const QueryPoints& points) {
  QueryCoordinates q;
  for (std::size_t i = 0; i < 4; ++i) {
    q.start[i] = {points[i][0], points[i][1], points[i][2]};
    q.end[i] = {points[i + 4][0], points[i + 4][1], points[i + 4][2]};
  }
  return q;
}

Decision decide_fixed(ContactKind kind, const QueryCoordinates& q) {
  return exact::decide_fixed<FixedInteger>(kind, q);
}

struct Counts {
  int hits = 0, misses = 0, undecided = 0, wrong = 0;

  void add(ContactKind kind, const QueryPoints& points) {
    const QueryCoordinates q = coordinates(points);
    const Decision fixed = decide_fixed(kind, q);
    if (fixed.kind == Decision::undecided) {
      ++undecided;
      return;
    }
    const Decision any = decide_exactly(kind, q);
    const bool right =
        fixed.kind == any.kind && (fixed.kind == Decision::miss || fixed.tick == any.tick);
    ++(fixed.kind == Decision::hit ? hits : misses);
    wrong += !right;
  }
  int all() const { return hits + misses + undecided; }
};

// Coordinates beyond the range of a float stay.
QueryPoints in_float(QueryPoints points) {
  for (auto& point : points)
    for (double& x : point)
      if (std::abs(x) < 1e30) x = static_cast<float>(x);
  return points;
}

}  // namespace

TEST_CASE("integers of fixed width decide as integers of any size, on hard queries") {
  Counts total;
  for (const Generator& generator : generators()) {
    CAPTURE(generator.name);
    Counts counts;
    for (const ContactKind kind : {ContactKind::vertex_face, ContactKind::edge_edge})
      for (std::uint64_t i = 0; i < repetitions(200); ++i) {
        const QueryPoints points = generate(generator, kind, 5, i);
        counts.add(kind, points);
        counts.add(kind, in_float(points));
      }
    CHECK(counts.wrong == 0);
    UNSCOPED_INFO(generator.name << ": " << counts.undecided << " of " << counts.all());
    total.undecided += counts.undecided;
    total.hits += counts.hits;
    total.misses += counts.misses;
  }
  CHECK(total.hits > 0);
  CHECK(total.misses > 0);
  CHECK(total.undecided < total.all() / 5);
}

TEST_CASE("integers of fixed width decide lattice queries with common and multiple roots") {
  // Small integers as coordinates make most of the signs zero that can be.
  std::mt19937 random(7);
  Counts counts;
  for (int i = 0; i < static_cast<int>(repetitions(6000)); ++i) {
    const int range = 1 + i % 4;
    QueryPoints points;
    for (auto& point : points)
      for (double& x : point)
        x = static_cast<double>(static_cast<int>(random() % static_cast<unsigned>(2 * range + 1)) -
                                range);
    if (i % 5 == 0)  // in one plane at all times
      for (auto& point : points) point[2] = point[0] + 2 * point[1];
    if (i % 7 == 0)  // at rest, or a pure translation
      for (std::size_t v = 0; v < 4; ++v)
        for (std::size_t k = 0; k < 3; ++k) points[v + 4][k] = points[v][k] + (v == 0 ? i % 3 : 1);
    counts.add(i % 2 == 0 ? ContactKind::vertex_face : ContactKind::edge_edge, points);
  }
  CHECK(counts.wrong == 0);
  CHECK(counts.undecided == 0);
  CHECK(counts.hits > counts.all() / 20);
}

TEST_CASE("a query whose coordinates span too many binary places is left to integers of any size") {
  QueryPoints points{};
  points[0] = {0x1p60, 1, 1};
  points[1] = {0x1p-60, 0, 0};
  points[2] = {1, 0, 0};
  points[3] = {0, 1, 0};
  for (std::size_t i = 0; i < 4; ++i) points[i + 4] = points[i];
  points[4][2] = -1;
  CHECK(decide_fixed(ContactKind::vertex_face, coordinates(points)).kind == Decision::undecided);
}
