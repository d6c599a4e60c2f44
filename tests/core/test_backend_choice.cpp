// The choice of the backend, against costs that are given as functions of the step.
#include <algorithm>
#include <functional>

#include "backend_choice.h"
#include "support/catch.h"

using namespace lazyccd;

namespace {

struct Costs {
  std::function<double(int)> cpu, cuda;  // by step, milliseconds
  double cpu_start = 0, cuda_start = 0;  // what the first detection of each costs more
};

struct Run {
  int steps = 0, switches = 0;
  double total = 0, best = 0;
  Backend last = Backend::cpu;
  int last_switch = 0;
};

void simulate(BackendChoice& choice, const Costs& costs, int steps, Run& run) {
  bool cpu_started = false, cuda_started = false;
  for (int i = 0; i < steps; ++i, ++run.steps) {
    const Backend backend = choice.next();
    const bool on_cpu = backend == Backend::cpu;
    double ms = on_cpu ? costs.cpu(i) : costs.cuda(i);
    bool& started = on_cpu ? cpu_started : cuda_started;
    if (!started) ms += on_cpu ? costs.cpu_start : costs.cuda_start;
    started = true;
    choice.record(ms);
    run.total += ms;
    run.best += std::min(costs.cpu(i), costs.cuda(i));
    if (backend != run.last) {
      ++run.switches;
      run.last_switch = i;
    }
    run.last = backend;
  }
}

Run simulate(std::size_t faces, const Costs& costs, int steps) {
  BackendChoice choice;
  choice.set_scene(faces);
  Run run;
  run.last = choice.next();
  simulate(choice, costs, steps, run);
  return run;
}

std::function<double(int)> always(double ms) {
  return [ms](int) { return ms; };
}

}  // namespace

TEST_CASE("backend choice: scenes too small for a GPU, or too large for the CPU, have no trial",
          "[core]") {
  const Run small = simulate(999, {always(5), always(0.1)}, 20000);
  CHECK(small.last == Backend::cpu);
  CHECK(small.switches == 0);
  const Run large = simulate(300000, {always(0.1), always(5)}, 20000);
  CHECK(large.last == Backend::cuda);
  CHECK(large.switches == 0);
  // The CPU is faster than any launch.
  CHECK(simulate(1500, {always(0.04), always(0.01)}, 20000).switches == 0);
}

TEST_CASE("backend choice: the faster one takes over, whatever its start costs", "[core]") {
  const Run to_cuda = simulate(1500, {always(1), always(0.2), 0, 50}, 5000);
  CHECK(to_cuda.last == Backend::cuda);
  CHECK(to_cuda.last_switch < 4000);
  const Run to_cpu = simulate(20000, {always(0.05), always(0.4), 30, 0}, 20000);
  CHECK(to_cpu.last == Backend::cpu);
  CHECK(to_cpu.total < 20000 * 0.2);
}

TEST_CASE("backend choice: trials cost no more than their share", "[core]") {
  for (const double ratio : {0.91, 1.0, 1.5, 10.0, 300.0}) {
    const double cpu = 2, cuda = ratio * cpu;
    const Run run = simulate(1500, {always(cpu), always(cuda), 0, 10}, 50000);
    CAPTURE(ratio);
    CHECK(run.last == Backend::cpu);
    // The first trial cannot know what it will cost. It ends after its second detection.
    CHECK(run.total <= (1 + BackendChoice::max_trial_share) * 50000 * cpu + 10 + 2 * cuda);
  }
}

TEST_CASE("backend choice: it follows a scene that changes, and never swings", "[core]") {
  // A heap falls, lies at rest, and falls again.
  const Costs costs{[](int i) { return i / 5000 % 2 == 0 ? 6.0 : 0.05; }, always(0.4), 20, 5};
  const Run run = simulate(20000, costs, 20000);
  CHECK(run.last == Backend::cpu);
  CHECK(run.total < 1.5 * run.best);
  CHECK(run.switches < 40);
}

TEST_CASE("backend choice: pauses that other programs cause decide nothing", "[core]") {
  const auto with_pauses = [](double ms, int period) {
    return [ms, period](int i) { return i % period == 0 ? ms + 30 : ms; };
  };
  const Run run = simulate(20000, {with_pauses(1.2, 41), with_pauses(1, 67)}, 50000);
  CHECK(run.last == Backend::cuda);
  CHECK(simulate(1500, {with_pauses(1, 41), with_pauses(1.2, 67)}, 50000).last == Backend::cpu);
}

TEST_CASE("backend choice: a changed topology of about the same size keeps it", "[core]") {
  BackendChoice choice;
  choice.set_scene(1500);
  Run run;
  simulate(choice, {always(1), always(0.2), 0, 5}, 3000, run);
  REQUIRE(choice.next() == Backend::cuda);
  choice.set_scene(1600);
  CHECK(choice.next() == Backend::cuda);
  choice.set_scene(900);
  CHECK(choice.next() == Backend::cpu);
  choice.set_scene(100000);
  CHECK(choice.next() == Backend::cuda);
}
