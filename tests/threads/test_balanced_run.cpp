#include <atomic>
#include <cstdint>
#include <stdexcept>
#include <thread>

#include "cpu/strategies/balanced_run.h"
#include "support/catch.h"
#include "threads/ranges.h"

namespace {

using lazyccd::BalancedRun;
using lazyccd::LazyStealing;
using lazyccd::NodePair;
using lazyccd::RunCounts;
using lazyccd::ThreadPool;
using namespace lazyccd::test;

template <std::uint32_t ChunkSize>
void check_every_small_size() {
  constexpr std::uint32_t count = 10'000;
  for (const int threads : {1, 2, 3, 16}) {
    ThreadPool pool(threads);
    for (const std::uint32_t ring : {1u, 2u, 0u}) {
      for (const std::uint32_t chunks : {1u, 2u, 0u}) {
        BalancedRun<NodePair, LazyStealing<NodePair, ChunkSize>> run(pool, ring, chunks);
        for (const Shape shape : {Shape::random, Shape::chain, Shape::flat}) {
          Visits visits(count);
          const RunCounts counts = visit_all(run, shape, {{0, count}}, visits);
          CAPTURE(ChunkSize, threads, ring, chunks, static_cast<int>(shape));
          CHECK(visits.each_once());
          CHECK(counts.items == count);
        }
      }
    }
  }
}

}  // namespace

TEST_CASE("an item is processed exactly once for all sizes of rings and chunks and their pool") {
  SECTION("one item a chunk") { check_every_small_size<1>(); }
  SECTION("two items a chunk") { check_every_small_size<2>(); }
  SECTION("chunks of the usual size") { check_every_small_size<256>(); }
}

TEST_CASE("each initial item is processed exactly once for any number of them") {
  // Around the size of a chunk: initial items are distributed in chunks.
  const std::uint32_t pieces = GENERATE(1u, 2u, 255u, 256u, 257u, 5000u);
  constexpr std::uint32_t count = 50'000;
  ThreadPool pool(4);
  BalancedRun<NodePair> run(pool);
  Visits visits(count);
  CHECK(visit_all(run, Shape::random, pieces_of(count, pieces), visits).items == count);
  CHECK(visits.each_once());
}

TEST_CASE("a run without items does nothing") {
  ThreadPool pool(3);
  BalancedRun<NodePair> run(pool);
  const RunCounts counts =
      run.run(nullptr, 0, [](int, NodePair, auto&) { FAIL("an item from nowhere"); });
  CHECK(counts.items == 0);
}

TEST_CASE("in many runs no worker leaves early and the memory stays the same") {
  ThreadPool pool(5);
  BalancedRun<NodePair, LazyStealing<NodePair, 2>> run(pool, 2u);
  std::size_t bytes = 0;
  for (std::uint32_t i = 0; i < 500; ++i) {
    const std::uint32_t count = 1 + hash(i) % 2000;
    Visits visits(count);
    REQUIRE(visit_all(run, Shape::random, {{0, count}}, visits).items == count);
    REQUIRE(visits.each_once());
    if (i == 100) bytes = run.bytes();
    if (i > 100) REQUIRE(run.bytes() == bytes);
  }
}

TEST_CASE("a single worker shares nothing") {
  ThreadPool pool(1);
  BalancedRun<NodePair> run(pool);
  Visits visits(10'000);
  const RunCounts counts = visit_all(run, Shape::flat, {{0, 10'000}}, visits);
  CHECK(counts.steals == 0);
  CHECK(counts.overflows == 0);
}

TEST_CASE("an idle worker gets some of the items of another") {
  ThreadPool pool(2);
  BalancedRun<NodePair> run(pool);
  std::atomic<bool> shared{false};
  // One worker takes both items. They are emitted again until the other worker gets one.
  const NodePair initial[2] = {{0, 0}, {1, 0}};
  std::atomic<int> first_worker{-1};
  const RunCounts counts = run.run(initial, 2, [&](int worker, NodePair item, auto& emit) {
    int nobody = -1;
    if (!first_worker.compare_exchange_strong(nobody, worker) && nobody != worker) shared = true;
    if (shared) return;
    std::this_thread::yield();
    emit(item);
  });
  CHECK(shared);
  CHECK(counts.steals >= 1);
}

TEST_CASE("an exception ends the run and reaches the caller and the next run is right") {
  const int threads = GENERATE(1, 2, 8);
  ThreadPool pool(threads);
  BalancedRun<NodePair, LazyStealing<NodePair, 2>> run(pool, 2u);
  for (std::uint32_t i = 0; i < 50; ++i) {
    const std::uint32_t bad = hash(i) % 5000;
    const NodePair root{0, 5000};
    CHECK_THROWS_AS(run.run(&root, 1,
                            [&](int, NodePair range, auto& emit) {
                              if (range.a == bad) throw std::runtime_error("bad item");
                              maybe_stall(range.a);
                              split(Shape::random, range, emit);
                            }),
                    std::runtime_error);
    Visits visits(5000);
    REQUIRE(visit_all(run, Shape::random, {{0, 5000}}, visits).items == 5000);
    REQUIRE(visits.each_once());
  }
}

TEST_CASE("two runs on two pools at once do not disturb each other") {
  const auto work = [](std::uint32_t seed, bool& right) {
    ThreadPool pool(3);
    BalancedRun<NodePair> run(pool);
    right = true;
    for (std::uint32_t i = 0; i < 50; ++i) {
      const std::uint32_t count = 1 + hash(i + seed) % 5000;
      Visits visits(count);
      right = right && visit_all(run, Shape::random, {{0, count}}, visits).items == count;
      right = right && visits.each_once();
    }
  };
  bool right_a = false, right_b = false;
  std::thread other([&] { work(7, right_b); });
  work(1, right_a);
  other.join();
  CHECK(right_a);
  CHECK(right_b);
}
