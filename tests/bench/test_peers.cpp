// The other methods of the chart must be right where they claim to be. Otherwise the comparison is
// unfair.
#include <string>
#include <vector>

#include "bench/accuracy/query_sets.h"
#include "bench/peers/lazyccd_settings.h"
#include "bench/peers/method.h"
#include "bench/peers/peer.h"
#include "support/catch.h"
#include "support/data.h"
#include "support/generators.h"

using namespace lazyccd;

namespace {

// A vertex falls through the middle of a unit face and meets it at a quarter of the step. `aside`
// shifts the vertex along x; from 0.5 on it misses the face.
QueryPoints falling_vertex(double aside) {
  const double x = 0.25 + aside;
  return {{{x, 0.25, 1},
           {0, 0, 0},
           {1, 0, 0},
           {0, 1, 0},
           {x, 0.25, -3},
           {0, 0, 0},
           {1, 0, 0},
           {0, 1, 0}}};
}

// An edge along y falls through an edge along x and meets it at half of the step.
QueryPoints falling_edge(double aside) {
  const double x = 0.5 + aside;
  return {
      {{x, -1, 1}, {x, 1, 1}, {0, 0, 0}, {1, 0, 0}, {x, -1, -1}, {x, 1, -1}, {0, 0, 0}, {1, 0, 0}}};
}

struct Example {
  ContactKind kind;
  QueryPoints points;
  bool hit;
  double toi;
};

std::vector<Example> examples() {
  return {{ContactKind::vertex_face, falling_vertex(0), true, 0.25},
          {ContactKind::vertex_face, falling_vertex(0.25), true, 0.25},
          {ContactKind::vertex_face, falling_vertex(0.75), false, 0},
          {ContactKind::edge_edge, falling_edge(0), true, 0.5},
          {ContactKind::edge_edge, falling_edge(0.75), false, 0}};
}

QueryResult answer(const peers::Method& method, ContactKind kind, const QueryPoints& points) {
  QueryResult result;
  std::vector<QueryPoints> queries{points};
  method.solve(kind, queries, Span<QueryResult>(&result, 1));
  return result;
}

bool is_filter(const peers::Method& method) { return method.name == "non-coplanar filter"; }

}  // namespace

TEST_CASE("every method answers easy queries correctly") {
  for (const peers::Method& method : peers::all_methods()) {
    // The filter tests planes, not faces. Bullet takes motion along an axis as separated.
    if (is_filter(method) || method.name == "Bullet") continue;
    for (const Example& example : examples()) {
      INFO(method.name << " in " << method.precision);
      const QueryResult result = answer(method, example.kind, example.points);
      CHECK(result.hit == example.hit);
      if (example.hit && method.gives_time)
        CHECK_THAT(result.toi, Matchers::WithinAbs(example.toi, 2e-6));
    }
  }
}

TEST_CASE("LazyCCD's settings give the same answers, bit by bit") {
  const auto check = [](ContactKind kind, const std::vector<QueryPoints>& queries) {
    std::vector<QueryResult> lanes(queries.size());
    peers::decide_in_lanes(kind, queries, lanes);
    std::size_t different = 0;
    for (std::size_t i = 0; i < queries.size(); ++i) {
      const QueryResult one = decide(kind, queries[i]);
      const QueryResult twice = peers::decide_double_only(kind, queries[i]);
      for (const QueryResult& other : {lanes[i], twice})
        different += other.hit != one.hit || (one.hit && other.toi != one.toi);
    }
    CHECK(different == 0);
  };
  for (const auto kind : {ContactKind::vertex_face, ContactKind::edge_edge}) {
    std::vector<QueryPoints> queries;
    for (const test::Generator& generator : test::generators())
      for (std::uint64_t i = 0; i < 40; ++i)
        queries.push_back(test::generate(generator, kind, 7, i));
    check(kind, queries);
  }
  if (const auto data = test::data_dir())
    for (const bench::QuerySet& set : bench::read_query_sets(*data))
      if (set.name.rfind("bp-", 0) == 0) check(set.kind, set.queries);
}

TEST_CASE("Bullet finds an oblique vertex and misses one that moves along an axis") {
  QueryPoints oblique = falling_vertex(0);
  for (int end = 0; end < 2; ++end) {
    oblique[4 * end][0] += end ? 0.10 : -0.03;
    oblique[4 * end][1] += end ? 0.05 : -0.02;
  }
  REQUIRE(decide(ContactKind::vertex_face, oblique).hit);
  for (const peers::Method& method : peers::all_methods()) {
    if (method.name != "Bullet") continue;
    INFO(method.precision);
    CHECK(answer(method, ContactKind::vertex_face, oblique).hit);
    CHECK_FALSE(answer(method, ContactKind::vertex_face, falling_vertex(0)).hit);
  }
}

TEST_CASE("the non-coplanar filter keeps touching pairs and culls pairs that stay on one side") {
  QueryPoints stays_above = falling_vertex(0);
  stays_above[4][2] = 0.5;
  for (const peers::Method& method : peers::all_methods()) {
    if (!is_filter(method)) continue;
    for (const Example& example : examples())
      if (example.hit) CHECK(answer(method, example.kind, example.points).hit);
    CHECK_FALSE(answer(method, ContactKind::vertex_face, stays_above).hit);
  }
}

TEST_CASE("interval subdivision is never late and reports a hit when it gives up") {
  // Both edges lie on one line at all times and slide into each other: every box has contacts.
  const QueryPoints sliding = {{{-2, 0, 0},
                                {-1, 0, 0},
                                {1, 0, 0},
                                {2, 0, 0},
                                {0, 0, 0},
                                {1, 0, 0},
                                {0.5, 0, 0},
                                {1.5, 0, 0}}};
  const QueryResult exact = decide(ContactKind::edge_edge, sliding);
  REQUIRE(exact.hit);
  for (const auto solve :
       {peers::interval_subdivision<double>, peers::interval_subdivision<float>}) {
    const QueryResult result = solve(ContactKind::edge_edge, sliding);
    CHECK(result.hit);
    CHECK(result.toi <= exact.toi);
  }
}

TEST_CASE("interval subdivision misses no contact in the queries of a broad phase") {
  const auto data = test::data_dir();
  if (!data) return;
  for (const bench::QuerySet& set : bench::read_query_sets(*data)) {
    if (set.name.rfind("bp-", 0) != 0) continue;
    std::size_t missed = 0, false_hits = 0, late = 0;
    for (std::size_t i = 0; i < set.queries.size(); i += 8) {
      const QueryResult result = peers::interval_subdivision<double>(set.kind, set.queries[i]);
      missed += set.hit[i] && !result.hit;
      false_hits += !set.hit[i] && result.hit;
      late += set.hit[i] && result.toi > set.toi[i];
    }
    INFO(set.name);
    CHECK(missed == 0);
    CHECK(late == 0);
    CHECK(false_hits <= set.queries.size() / 8 / 50);
  }
}

TEST_CASE("the roots of the cubic are found to working precision") {
  for (const double z : {0.01, 0.3, 0.5, 0.77, 0.99}) {
    // The vertex falls from height z by 1 while the face rotates slightly.
    const QueryPoints q = {{{0.25, 0.25, z},
                            {0, 0, 0},
                            {1, 0, 0},
                            {0, 1, 0},
                            {0.25, 0.25, z - 1},
                            {0, 0, 0},
                            {1, 0, 0.25},
                            {0, 1, -0.25}}};
    const QueryResult exact = decide(ContactKind::vertex_face, q);
    REQUIRE(exact.hit);
    CHECK_THAT(peers::cubic_newton<double>(ContactKind::vertex_face, q).toi,
               Matchers::WithinAbs(exact.toi, 1e-9));
    CHECK_THAT(peers::cubic_newton<float>(ContactKind::vertex_face, q).toi,
               Matchers::WithinAbs(exact.toi, 1e-5));
  }
}
