#include "lazyccd/thread_choice.h"

#include <algorithm>
#include <functional>

#include "support/catch.h"

using namespace lazyccd;

namespace {

// Times of steps, by the number of the step, milliseconds.
using Cost = std::function<double(int)>;

Cost always(double ms) {
  return [ms](int) { return ms; };
}

struct Run {
  int on_all = 0;  // steps that used all threads
  bool ends_on_all = false;
  double total = 0, best = 0;  // milliseconds
};

Run simulate(ThreadChoice& choice, const Cost& on_one, const Cost& on_all, int steps) {
  Run run;
  for (int i = 0; i < steps; ++i) {
    choice.begin_step(1000);
    run.ends_on_all = choice.uses_all_threads();
    const double ms = run.ends_on_all ? on_all(i) : on_one(i);
    choice.record(ms);
    run.on_all += run.ends_on_all;
    run.total += ms;
    run.best += std::min(on_one(i), on_all(i));
  }
  return run;
}

Run simulate(const Cost& on_one, const Cost& on_all, int steps) {
  ThreadChoice choice(Threads(2), true);
  return simulate(choice, on_one, on_all, steps);
}

}  // namespace

TEST_CASE("thread choice: a tiny step never wakes a thread", "[core]") {
  CHECK(simulate(always(0.15), always(0.01), 2000).on_all == 0);
}

TEST_CASE("thread choice: all threads take over where they help, and only there", "[core]") {
  const Run large = simulate(always(5), always(3), 2000);
  CHECK(large.ends_on_all);
  CHECK(large.total < 1.02 * large.best);
  const Run larger = simulate(always(5), always(5.5), 2000);
  CHECK_FALSE(larger.ends_on_all);
  CHECK(larger.total < 1.02 * larger.best);
  // Two threads would burn more processor time than the small step gets shorter.
  CHECK_FALSE(simulate(always(0.4), always(0.3), 2000).ends_on_all);
  CHECK(simulate(always(0.4), always(0.2), 2000).ends_on_all);
}

TEST_CASE("thread choice: it follows a scene that falls and comes to rest", "[core]") {
  const auto load = [](int i) { return i % 3000 < 1500 ? 6.0 : 0.3; };
  const Run run = simulate(
      load, [&](int i) { return 0.2 + 0.5 * load(i); }, 12000);
  CHECK(run.total < 1.03 * run.best);
}

TEST_CASE("thread choice: a step that gets longer all the time does not hide what threads gain",
          "[core]") {
  const auto rising = [](int i) { return 1 + 0.1 * i; };
  CHECK(simulate(
            rising, [&](int i) { return 0.8 * rising(i); }, 300)
            .ends_on_all);
}

TEST_CASE("thread choice: a fixed number of threads is always used", "[core]") {
  ThreadChoice choice(Threads(2), false);
  CHECK(simulate(choice, always(0.1), always(1), 100).on_all == 100);
}

TEST_CASE("thread choice: steps on the calling thread alone use no other", "[core]") {
  const Threads threads(3);
  if (threads.is_caller_only()) {
    WARN("skipped: there are no threads");
    return;
  }
  ThreadChoice choice(threads, true);
  choice.begin_step(10);
  CHECK(threads.is_caller_only());
  int ranges = 0;
  threads.parallel_for(100000, 1, [&](std::size_t, std::size_t) { ++ranges; });
  CHECK(ranges == 1);
}
