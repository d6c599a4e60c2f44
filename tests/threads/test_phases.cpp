#include <algorithm>
#include <atomic>
#include <cfenv>
#include <cstddef>
#include <stdexcept>
#include <thread>
#include <vector>

#include "lazyccd/threads.h"
#include "support/catch.h"

using lazyccd::Threads;

TEST_CASE("each item of each phase runs once, and phases follow each other") {
  const int count = GENERATE(1, 2, 3, 16);
  const Threads threads(count);
  const std::vector<std::size_t> sizes = {1, 100, 3, 1000, 1, 1, 64};
  for (int round = 0; round < 100; ++round) {
    std::size_t phase = 0;
    std::vector<std::vector<int>> calls;  // not atomic: each item is one thread's
    for (const std::size_t size : sizes) calls.emplace_back(size, 0);
    std::atomic<int> wrong{0};
    std::size_t sum = 0;  // of the last phase
    threads.run_phases(
        sizes[0],
        [&](std::size_t item, int worker) {
          if (worker < 0 || worker >= count) ++wrong;
          if (phase > 0 && sum != sizes[phase - 1]) ++wrong;
          ++calls[phase][item];
        },
        [&]() -> std::size_t {
          sum = 0;
          for (const int calls_of_item : calls[phase])
            sum += static_cast<std::size_t>(calls_of_item);
          return ++phase < sizes.size() ? sizes[phase] : 0;
        });
    CHECK(wrong == 0);
    CHECK(phase == sizes.size());
    for (const std::vector<int>& of_phase : calls)
      CHECK(std::all_of(of_phase.begin(), of_phase.end(), [](int n) { return n == 1; }));
  }
}

TEST_CASE("no two threads have the same worker at a time") {
  const Threads threads(8);
  std::vector<int> inside(8, 0);  // not atomic: a worker is one thread's
  int phases = 0;
  threads.run_phases(
      200,
      [&](std::size_t, int worker) {
        int& here = inside[static_cast<std::size_t>(worker)];
        ++here;
        if (here != 1) throw std::logic_error("two threads are the same worker");
        --here;
      },
      [&]() -> std::size_t { return ++phases < 50 ? 200 : 0; });
  CHECK(phases == 50);
}

TEST_CASE("a single item runs on the thread that ended the phase before") {
  const Threads threads(4);
  int phase = 0;
  std::thread::id ended;
  std::atomic<int> elsewhere{0};
  threads.run_phases(
      1,
      [&](std::size_t, int) {
        if (phase % 2 == 0 && phase > 0 && std::this_thread::get_id() != ended) ++elsewhere;
      },
      [&]() -> std::size_t {
        ended = std::this_thread::get_id();
        return ++phase < 200 ? (phase % 2 == 0 ? 1 : 100) : 0;
      });
  CHECK(phase == 200);
  CHECK(elsewhere == 0);
}

TEST_CASE("all threads have the rounding mode of the caller, and then their own again") {
  const Threads threads(4);
  std::atomic<int> wrong{0};
  for (const int mode : {FE_UPWARD, FE_TONEAREST, FE_DOWNWARD, FE_TONEAREST}) {
    std::fesetround(mode);
    const auto check = [&](std::size_t, std::size_t) {
      if (std::fegetround() != mode) ++wrong;
    };
    for (int i = 0; i < 20; ++i) {
      threads.parallel_for(1000, 10, check);
      threads.run_phases(
          100, [&](std::size_t item, int) { check(item, item + 1); },
          [] { return std::size_t{0}; });
    }
  }
  CHECK(wrong == 0);
}

TEST_CASE("an exception ends the phases and reaches the caller") {
  const int count = GENERATE(1, 4);
  const Threads threads(count);
  int nexts = 0;
  const auto run = [&](bool in_item) {
    threads.run_phases(
        50,
        [&](std::size_t item, int) {
          if (in_item && nexts == 2 && item == 25) throw std::runtime_error("item");
        },
        [&]() -> std::size_t {
          if (!in_item && nexts == 2) throw std::runtime_error("next");
          return ++nexts < 10 ? 50 : 0;
        });
  };
  for (const bool in_item : {true, false}) {
    nexts = 0;
    CHECK_THROWS_AS(run(in_item), std::runtime_error);
    CHECK(nexts == 2);
  }
  threads.run_phases(
      0, [](std::size_t, int) {}, []() -> std::size_t { return 0; });
}
