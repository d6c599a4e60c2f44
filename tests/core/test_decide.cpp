// Compares the narrow phase and the exact stage with the oracle on generated queries, regular and
// degenerate. Also tests transformations that must not change an answer.
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include "core/narrow/decision.h"
#include "cpu/narrow/exact.h"
#include "lazyccd/error.h"
#include "support/catch.h"
#include "support/generators.h"
#include "support/oracle.h"
#include "support/test_budget.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

constexpr double tick = 0x1p-32;
constexpr std::uint64_t seed = 1;

// Number of queries of a generator and kind; a tenth if one query takes milliseconds.
std::uint64_t count_of(const Generator& generator, std::uint64_t count) {
  return generator.share == 1 ? count / 10 : count;
}

template <class Check>
void for_each_query(std::uint64_t count, Check check) {
  for (const Generator& generator : generators()) {
    for (const ContactKind kind : {ContactKind::vertex_face, ContactKind::edge_edge}) {
      for (std::uint64_t i = 0; i < count_of(generator, count); ++i) {
        INFO(generator.name << ", "
                            << (kind == ContactKind::vertex_face ? "vertex-face" : "edge-edge")
                            << ", number " << i);
        check(kind, generate(generator, kind, seed, i));
      }
    }
  }
}

bool is_right(const QueryResult& result, const Truth& truth) {
  if (!result.hit || !truth.hit()) return result.hit == truth.hit();
  return truth.compare(result.toi) >= 0 && truth.compare(result.toi + tick) < 0;
}

QueryPoints reordered(const QueryPoints& q, std::array<std::size_t, 8> order) {
  QueryPoints r;
  for (std::size_t i = 0; i < 8; ++i) r[i] = q[order[i]];
  return r;
}

}  // namespace

TEST_CASE("the narrow phase gives the true answer and the true time in whole ticks") {
  for_each_query(repetitions(1000), [](ContactKind kind, const QueryPoints& points) {
    const Truth truth = find_truth(kind, points);
    const bool right = is_right(decide(kind, points), truth);
    if (!right) CHECK(right);
  });
}

TEST_CASE("the exact stage gives the true answer and the true time in whole ticks") {
  for_each_query(repetitions(500), [](ContactKind kind, const QueryPoints& points) {
    const bool right = is_right(decide_exact(kind, points), find_truth(kind, points));
    if (!right) CHECK(right);
  });
}

TEST_CASE("double precision decides the same whether single precision was tried or not") {
  int decided = 0;
  for_each_query(500, [&](ContactKind kind, const QueryPoints& points) {
    QueryCoordinates q;
    for (std::size_t i = 0; i < 4; ++i) {
      q.start[i] = {points[i][0], points[i][1], points[i][2]};
      q.end[i] = {points[i + 4][0], points[i + 4][1], points[i + 4][2]};
    }
    // Coordinates up to 8 need no scaling; this test leaves it out.
    for (const auto& point : points)
      for (const double x : point)
        if (!(std::fabs(x) <= 8)) return;
    const Decision decision =
        kind == ContactKind::vertex_face
            ? decide_in_double<ContactKind::vertex_face>(
                  differences<ContactKind::vertex_face>(q, 1))
            : decide_in_double<ContactKind::edge_edge>(differences<ContactKind::edge_edge>(q, 1));
    if (decision.kind == Decision::undecided) return;
    ++decided;
    const QueryResult result = decide(kind, points);
    const bool same = result.hit == (decision.kind == Decision::hit) &&
                      (!result.hit || result.toi == static_cast<double>(decision.tick) * tick);
    if (!same) CHECK(same);
  });
  CHECK(decided > 5000);
}

TEST_CASE("renaming points changes neither answer nor time") {
  for_each_query(repetitions(200), [](ContactKind kind, const QueryPoints& points) {
    using Order = std::array<std::size_t, 8>;
    const auto orders = kind == ContactKind::vertex_face
                            ? std::array<Order, 3>{{{0, 2, 3, 1, 4, 6, 7, 5},    // the face turned
                                                    {0, 3, 1, 2, 4, 7, 5, 6},    // and again
                                                    {0, 1, 3, 2, 4, 5, 7, 6}}}   // and mirrored
                            : std::array<Order, 3>{{{1, 0, 2, 3, 5, 4, 6, 7},    // edge a reversed
                                                    {0, 1, 3, 2, 4, 5, 7, 6},    // edge b reversed
                                                    {2, 3, 0, 1, 6, 7, 4, 5}}};  // edges exchanged
    const QueryResult result = decide(kind, points);
    for (const auto& order : orders) {
      const QueryResult other = decide(kind, reordered(points, order));
      const bool same = other.hit == result.hit && (!result.hit || other.toi == result.toi);
      if (!same) CHECK(same);
    }
  });
}

TEST_CASE("exchanging start and end of the step does not change the answer") {
  for_each_query(repetitions(500), [](ContactKind kind, const QueryPoints& points) {
    const QueryPoints back = reordered(points, {4, 5, 6, 7, 0, 1, 2, 3});
    const bool same = decide(kind, back).hit == decide(kind, points).hit;
    if (!same) CHECK(same);
  });
}

TEST_CASE("a contact at the start of the step has time 0, one at its end only time 1") {
  for (const Generator& generator : generators()) {
    if (std::string_view(generator.name) != "touch_start") continue;
    for (const ContactKind kind : {ContactKind::vertex_face, ContactKind::edge_edge}) {
      for (std::uint64_t i = 0; i < 200; ++i) {
        const QueryResult result = decide(kind, generate(generator, kind, seed, i));
        CHECK(result.hit);
        CHECK(result.toi == 0);
      }
    }
  }
  const QueryPoints landing{{{0.25, 0.25, 1},
                             {0, 0, 0},
                             {1, 0, 0},
                             {0, 1, 0},
                             {0.25, 0.25, 0},
                             {0, 0, 0},
                             {1, 0, 0},
                             {0, 1, 0}}};
  CHECK(decide(ContactKind::vertex_face, landing).hit);
  CHECK(decide(ContactKind::vertex_face, landing).toi == 1);
}

TEST_CASE("an infinite or undefined coordinate is refused") {
  for (const double bad :
       {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
        std::numeric_limits<double>::quiet_NaN()}) {
    for (std::size_t i = 0; i < 24; ++i) {
      QueryPoints points{};
      points[i / 3][i % 3] = bad;
      for (const ContactKind kind : {ContactKind::vertex_face, ContactKind::edge_edge}) {
        bool refused = false;
        try {
          decide(kind, points);
        } catch (const Error& error) {
          refused = error.code() == ErrorCode::non_finite_position;
        }
        CHECK(refused);
      }
    }
  }
}
