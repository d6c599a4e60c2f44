// The program lazyccd_bench_balance: measures the cost of balancing. That is the operations of the
// deque, an item that is never shared, the start of a job, and a traversal on one and more threads.
//
//   lazyccd_bench_balance [--benchmark_filter=...]

#include <benchmark/benchmark.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <thread>

#include "balance/deque.h"
#include "balance/host_atomics.h"
#include "cpu/strategies/balanced_run.h"
#include "host/threads/spin_wait.h"

namespace {

using lazyccd::BalancedRun;
using lazyccd::NodePair;
using lazyccd::ThreadPool;

struct DequeMemory {
  static constexpr std::uint32_t capacity = 64;
  alignas(128) std::atomic<std::uint64_t> word{0};
  std::atomic<std::uint32_t> ring[capacity] = {};
  lazyccd::Deque<lazyccd::HostAtomics> deque() { return {word, ring, capacity}; }
};

void push_and_pop(benchmark::State& state) {
  DequeMemory memory;
  auto deque = memory.deque();
  for (auto _ : state) {
    deque.push(1);
    benchmark::DoNotOptimize(deque.pop());
  }
}
BENCHMARK(push_and_pop);

void push_and_steal(benchmark::State& state) {
  DequeMemory memory;
  auto deque = memory.deque();
  for (auto _ : state) {
    deque.push(1);
    benchmark::DoNotOptimize(deque.steal());
  }
}
BENCHMARK(push_and_steal);

// Owner and thief on two cores. Measures a push while the word is in the cache of the other core.
void push_against_a_thief(benchmark::State& state) {
  DequeMemory memory;
  std::atomic<bool> stop{false};
  std::thread thief([&] {
    auto deque = memory.deque();
    while (!stop.load(std::memory_order_relaxed)) benchmark::DoNotOptimize(deque.steal());
  });
  auto deque = memory.deque();
  for (auto _ : state) {
    while (!deque.has_room()) lazyccd::cpu_relax();
    deque.push(1);
  }
  stop = true;
  thief.join();
}
BENCHMARK(push_against_a_thief)->UseRealTime();

// A binary tree whose leaves take `leaf_ns` each. 0 shows the cost of an item by itself; 1000 is
// about the time of a pair of groups of faces.
void traversal(benchmark::State& state) {
  ThreadPool pool(static_cast<int>(state.range(0)));
  BalancedRun<NodePair> run(pool);
  const std::chrono::nanoseconds leaf(state.range(1));
  const std::uint32_t depth = state.range(1) == 0 ? 20 : 14;
  const NodePair root{0, 0};
  std::uint64_t items = 0, steals = 0;
  for (auto _ : state) {
    const lazyccd::RunCounts counts = run.run(&root, 1, [&](int, NodePair node, auto& emit) {
      if (node.a < depth) {
        emit(NodePair{node.a + 1, 2 * node.b});
        emit(NodePair{node.a + 1, 2 * node.b + 1});
      } else if (leaf.count() > 0) {
        const auto end = std::chrono::steady_clock::now() + leaf;
        while (std::chrono::steady_clock::now() < end) lazyccd::cpu_relax();
      }
    });
    items += counts.items;
    steals += counts.steals;
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(items));
  state.counters["steals"] =
      benchmark::Counter(static_cast<double>(steals), benchmark::Counter::kAvgIterations);
}
BENCHMARK(traversal)
    ->ArgNames({"threads", "leaf_ns"})
    ->ArgsProduct({{1, 2}, {0, 1000}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

// Empty jobs, one after another, while the workers are awake.
void run_awake(benchmark::State& state) {
  ThreadPool pool(static_cast<int>(state.range(0)));
  for (auto _ : state) pool.run([](int) {});
}
BENCHMARK(run_awake)->ArgName("threads")->Arg(1)->Arg(2)->UseRealTime();

// An empty job after a pause in which the workers fell asleep, from the call to the end of the last
// worker's part.
void run_asleep(benchmark::State& state) {
  ThreadPool pool(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const auto start = std::chrono::steady_clock::now();
    pool.run([](int) {});
    const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
    state.SetIterationTime(time.count());
  }
}
BENCHMARK(run_asleep)->ArgName("threads")->Arg(2)->UseManualTime()->Iterations(500);

}  // namespace

BENCHMARK_MAIN();
