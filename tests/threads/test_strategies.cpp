// The same tests for every balancing strategy: each item is processed exactly once, with buffers of
// any size, in many runs, and after exceptions.
#include <cstdint>
#include <stdexcept>

#include "cpu/strategies/balanced_run.h"
#include "cpu/strategies/lazy_stealing.h"
#include "research/strategies/greedy_stealing.h"
#include "research/strategies/guided.h"
#include "research/strategies/static_list.h"
#include "research/strategies/task_stealing.h"
#include "support/catch.h"
#include "threads/ranges.h"

namespace {

using namespace lazyccd;
using namespace lazyccd::research;
using namespace lazyccd::test;

constexpr Shape shapes[] = {Shape::random, Shape::chain, Shape::flat};

// `sizes`: arguments of the strategy's constructor.
template <class Strategy, class... Sizes>
void check(Sizes... sizes) {
  for (const int threads : {1, 2, 3, 16}) {
    ThreadPool pool(threads);
    BalancedRun<NodePair, Strategy> run(pool, sizes...);
    constexpr std::uint32_t count = 5000;
    for (const Shape shape : shapes) {
      for (const std::uint32_t pieces : {1u, 2u, 300u}) {
        Visits visits(count);
        const RunCounts counts = visit_all(run, shape, pieces_of(count, pieces), visits);
        CAPTURE(threads, static_cast<int>(shape), pieces);
        CHECK(counts.items == count);
        CHECK(visits.each_once());
      }
    }
    for (std::uint32_t i = 0; i < 100; ++i) {
      const std::uint32_t items = 1 + hash(i) % 500;
      Visits visits(items);
      REQUIRE(visit_all(run, Shape::random, {{0, items}}, visits).items == items);
      REQUIRE(visits.each_once());
    }
    for (std::uint32_t i = 0; i < 20; ++i) {
      const std::uint32_t bad = hash(i) % count;
      const NodePair root{0, count};
      CHECK_THROWS_AS(run.run(&root, 1,
                              [&](int, NodePair range, auto& emit) {
                                if (range.a == bad) throw std::runtime_error("bad item");
                                maybe_stall(range.a);
                                split(Shape::random, range, emit);
                              }),
                      std::runtime_error);
      Visits visits(count);
      REQUIRE(visit_all(run, Shape::random, {{0, count}}, visits).items == count);
      REQUIRE(visits.each_once());
    }
  }
}

}  // namespace

TEST_CASE("lazy stealing processes each item exactly once") {
  SECTION("default sizes") { check<LazyStealing<NodePair>>(); }
  SECTION("one chunk in all, of two items at most") { check<LazyStealing<NodePair>>(1u, 1u, 2u); }
}

TEST_CASE("greedy lazy stealing processes each item exactly once") {
  SECTION("default sizes") { check<GreedyStealing<NodePair>>(); }
  SECTION("batches of one item from a stack of one") { check<GreedyStealing<NodePair>>(1u, 1u); }
  SECTION("one batch a worker") { check<GreedyStealing<NodePair>>(2u, 2u, 1u); }
}

TEST_CASE("static lists with a balancing step process each item exactly once") {
  SECTION("default sizes") { check<StaticList<NodePair>>(); }
  SECTION("a round ends with the first idle worker") { check<StaticList<NodePair>>(1u); }
  SECTION("lists of 24 items") { check<StaticList<NodePair>>(0u, 24u); }
}

TEST_CASE("task stealing processes each item exactly once") {
  SECTION("default sizes") { check<TaskStealing<NodePair>>(); }
  SECTION("deques of one task") { check<TaskStealing<NodePair>>(1u); }
  SECTION("deques of two tasks") { check<TaskStealing<NodePair>>(2u); }
}

TEST_CASE("guided portions of one list process each item exactly once") {
  SECTION("default sizes") { check<Guided<NodePair>>(); }
  SECTION("lists of one item") { check<Guided<NodePair>>(1u); }
  SECTION("lists of three items") { check<Guided<NodePair>>(3u); }
}
