#include <algorithm>
#include <atomic>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <thread>
#include <vector>

#include "cpu/balanced_run.h"
#include "cpu/pause.h"
#include "support/catch.h"

namespace {

using lazyccd::BalancedRun;
using lazyccd::LazyStealing;
using lazyccd::NodePair;
using lazyccd::RunCounts;
using lazyccd::ThreadPool;

std::uint32_t hash(std::uint32_t x) {
  x = (x ^ (x >> 16)) * 0x7feb352du;
  x = (x ^ (x >> 15)) * 0x846ca68bu;
  return x ^ (x >> 16);
}

// A range [a, b) of numbers visits a and hands on the rest in pieces; how lopsided is up to the
// shape.
enum class Shape { random, chain, flat };

template <class Emit>
void split(Shape shape, NodePair range, Emit& emit) {
  const std::uint32_t begin = range.a + 1, end = range.b;
  if (begin == end) return;
  const std::uint32_t size = end - begin;
  std::uint32_t cut = begin;
  switch (shape) {
    case Shape::random:
      cut += hash(begin ^ size) % size;
      break;
    case Shape::chain:  // one long path with a leaf at every step: the worst there is to share
      cut += size > 1 ? 1 : 0;
      break;
    case Shape::flat:  // halves
      cut += size / 2;
      break;
  }
  if (cut > begin) emit(NodePair{begin, cut});
  emit(NodePair{cut, end});
}

class Visits {
 public:
  explicit Visits(std::uint32_t count)
      : counts_(new std::atomic<std::uint8_t>[count]()), count_(count) {}
  void visit(std::uint32_t i) { counts_[i].fetch_add(1, std::memory_order_relaxed); }
  bool each_once() const {
    return std::all_of(counts_.get(), counts_.get() + count_, [](const auto& c) { return c == 1; });
  }

 private:
  std::unique_ptr<std::atomic<std::uint8_t>[]> counts_;
  std::uint32_t count_;
};

void maybe_stall(std::uint32_t number) {
  const std::uint32_t r = hash(number * 2654435761u) % 256;
  if (r == 0) std::this_thread::yield();
  if (r < 16)
    for (std::uint32_t i = 0; i < 10 * r; ++i) lazyccd::pause_core();
}

template <class Run>
RunCounts visit_all(Run& run, Shape shape, const std::vector<NodePair>& initial, Visits& visits) {
  return run.run(initial.data(), initial.size(), [&](int, NodePair range, auto& emit) {
    visits.visit(range.a);
    maybe_stall(range.a);
    split(shape, range, emit);
  });
}

// `pieces` ranges that together are [0, count).
std::vector<NodePair> pieces_of(std::uint32_t count, std::uint32_t pieces) {
  std::vector<NodePair> ranges;
  for (std::uint32_t i = 0; i < pieces; ++i)
    ranges.push_back({i * count / pieces, (i + 1) * count / pieces});
  return ranges;
}

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

TEST_CASE(
    "an item is processed exactly once, however small rings, chunks and the pool of chunks are") {
  SECTION("one item a chunk") { check_every_small_size<1>(); }
  SECTION("two items a chunk") { check_every_small_size<2>(); }
  SECTION("chunks of the usual size") { check_every_small_size<256>(); }
}

TEST_CASE("each initial item is processed exactly once, whatever their number") {
  // Around the size of a chunk, in which initial items are handed out.
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

TEST_CASE("run after run, no worker leaves early and the memory stays the same") {
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

TEST_CASE("a worker alone offers nothing") {
  ThreadPool pool(1);
  BalancedRun<NodePair> run(pool);
  Visits visits(10'000);
  const RunCounts counts = visit_all(run, Shape::flat, {{0, 10'000}}, visits);
  CHECK(counts.steals == 0);
  CHECK(counts.overflows == 0);
}

TEST_CASE("a hungry worker gets its share of another's items") {
  ThreadPool pool(2);
  BalancedRun<NodePair> run(pool);
  std::atomic<bool> shared{false};
  // Both items start with one worker and come back until the other has seen one.
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

TEST_CASE("an exception ends the run, reaches the caller, and the next run is right") {
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
