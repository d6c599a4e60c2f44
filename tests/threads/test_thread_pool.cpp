#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <stdexcept>
#include <thread>
#include <vector>

#if defined(__linux__)
#include <sched.h>
#endif

#include "host/threads/thread_pool.h"
#include "support/catch.h"

namespace {

using lazyccd::ThreadPool;

// Waits until the workers have stopped spinning and sleep.
void wait_until_workers_sleep() { std::this_thread::sleep_for(std::chrono::milliseconds(2)); }

void wait_for(const std::atomic<bool>& flag) {
  while (!flag) std::this_thread::yield();
}

}  // namespace

TEST_CASE("a pool has as many workers as asked for, and the machine's number for 0") {
  CHECK(ThreadPool(1).size() == 1);
  CHECK(ThreadPool(5).size() == 5);
  CHECK(ThreadPool(0).size() >= 1);
}

#if defined(__linux__)
TEST_CASE("a thread that may use one core gets a pool of one thread for 0") {
  int threads = 0;
  std::thread pinned([&] {
    cpu_set_t core;
    CPU_ZERO(&core);
    CPU_SET(static_cast<std::size_t>(sched_getcpu()), &core);
    if (sched_setaffinity(0, sizeof core, &core) == 0) threads = ThreadPool::resolve(0);
  });
  pinned.join();
  CHECK(threads == 1);
}
#endif

TEST_CASE("a pool is serial for a pool of one and for a submitted job, not while workers sleep") {
  CHECK(ThreadPool(1).is_serial());
  ThreadPool pool(3);
  pool.set_wake_policy(ThreadPool::WakePolicy::awake);
  wait_until_workers_sleep();
  CHECK_FALSE(pool.is_serial());
  std::atomic<bool> is_serial{false}, has_run{false};
  const auto job = [&](int) {
    is_serial = pool.is_serial();
    has_run = true;
  };
  pool.submit(job);
  wait_for(has_run);
  CHECK(pool.join_submitted());
  CHECK(is_serial);
}

TEST_CASE("a submitted job runs once on another thread or not at all") {
  const int threads = GENERATE(2, 3, 16);
  ThreadPool pool(threads);
  const auto caller = std::this_thread::get_id();
  for (int round = 0; round < 400; ++round) {
    if (round % 50 == 0) wait_until_workers_sleep();
    int calls = 0;  // not atomic: the pool orders the accesses
    std::atomic<bool> has_begun{false};
    const auto job = [&](int worker) {
      has_begun = true;
      calls += worker > 0 && worker < threads && std::this_thread::get_id() != caller ? 1 : 100;
    };
    pool.submit(job);
    // Joined at once, or later, or after it has begun.
    if (round % 3 == 1) std::this_thread::sleep_for(std::chrono::microseconds(round % 100));
    if (round % 3 == 2) wait_for(has_begun);
    const bool ran = pool.join_submitted();
    REQUIRE(calls == (ran ? 1 : 0));
    if (round % 3 == 2) REQUIRE(ran);
    if (round % 4 == 0) pool.prewake();
    if (round % 4 > 1) continue;
    std::vector<int> others(static_cast<std::size_t>(threads));
    pool.run([&](int worker) { ++others[static_cast<std::size_t>(worker)]; });
    REQUIRE(others == std::vector<int>(static_cast<std::size_t>(threads), 1));
    pool.run_optional([&](int worker) { ++others[static_cast<std::size_t>(worker)]; });
    REQUIRE(others[0] == 2);
    REQUIRE(calls == (ran ? 1 : 0));
  }
}

TEST_CASE("join_submitted waits for a job that has begun") {
  ThreadPool pool(4);
  std::atomic<bool> has_begun{false};
  bool has_ended = false;
  const auto job = [&](int) {
    has_begun = true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    has_ended = true;
  };
  pool.submit(job);
  wait_for(has_begun);
  CHECK(pool.join_submitted());
  CHECK(has_ended);
}

TEST_CASE("a submitted job runs its parallel loops alone while others use the pool") {
  const int threads = GENERATE(2, 4);
  ThreadPool pool(threads);
  for (int round = 0; round < 60; ++round) {
    std::atomic<bool> has_begun{false}, has_ended{false};
    int offered = 0, pieces = 0;  // not atomic: only the job writes them
    const auto job = [&](int) {
      has_begun = true;
      for (int i = 0; i < 20; ++i) {
        if (pool.available() != 1) offered = 100;
        pool.run_optional([&](int worker) { offered += worker == 0 ? 1 : 100; });
        pool.parallel_for(1000, 1, [&](std::size_t first, std::size_t last, int worker) {
          pieces += worker == 0 && first == 0 && last == 1000 ? 1 : 100;
        });
      }
      has_ended = true;
    };
    pool.submit(job);
    wait_for(has_begun);
    do {
      pool.set_wake_policy(round % 2 ? ThreadPool::WakePolicy::awake
                                     : ThreadPool::WakePolicy::everyone);
      std::vector<int> done(100);
      pool.parallel_for(100, 1, [&](std::size_t first, std::size_t last, int) {
        for (std::size_t i = first; i < last; ++i) ++done[i];
      });
      REQUIRE(done == std::vector<int>(100, 1));
    } while (!has_ended);
    REQUIRE(pool.join_submitted());
    REQUIRE(offered == 20);
    REQUIRE(pieces == 20);
  }
}

TEST_CASE("the pool works beside a submitted job without the worker that runs it") {
  const int threads = GENERATE(2, 3, 5);
  ThreadPool pool(threads);
  for (int round = 0; round < 40; ++round) {
    std::atomic<bool> has_begun{false}, may_end{false};
    std::atomic<int> who{0};
    const auto job = [&](int worker) {
      who = worker;
      has_begun = true;
      wait_for(may_end);
    };
    pool.submit(job);
    wait_for(has_begun);
    for (int i = 0; i < 5; ++i) {
      if (round % 10 == 0) wait_until_workers_sleep();
      std::vector<int> calls(static_cast<std::size_t>(threads));  // not atomic
      pool.run_optional([&](int worker) { ++calls[static_cast<std::size_t>(worker)]; });
      REQUIRE(calls[0] == 1);
      REQUIRE(*std::max_element(calls.begin(), calls.end()) == 1);
      REQUIRE(calls[static_cast<std::size_t>(who.load())] == 0);
      std::vector<int> done(1000);
      pool.parallel_for(1000, 10, [&](std::size_t first, std::size_t last, int worker) {
        for (std::size_t k = first; k < last; ++k) done[k] += worker == who ? 100 : 1;
      });
      REQUIRE(done == std::vector<int>(1000, 1));
    }
    may_end = true;
    REQUIRE(pool.join_submitted());
  }
}

TEST_CASE("a worker that finishes a submitted job joins an optional job in progress") {
  ThreadPool pool(2);
  for (int round = 0; round < 40; ++round) {
    std::atomic<bool> has_begun{false}, may_end{false}, has_come{false};
    const auto job = [&](int) {
      has_begun = true;
      wait_for(may_end);
    };
    pool.submit(job);
    if (round % 2 == 0) wait_for(has_begun);
    // The other thread joins this job only after the submitted one, even if that had not begun.
    bool was_first = true;
    pool.run_optional([&](int worker) {
      if (worker == 0) {
        may_end = true;
        wait_for(has_come);
      } else {
        was_first = has_begun;
        has_come = true;
      }
    });
    REQUIRE(was_first);
    REQUIRE(pool.join_submitted());
  }
}

TEST_CASE("a job for all workers waits for the worker of a submitted job") {
  ThreadPool pool(3);
  for (int round = 0; round < 20; ++round) {
    std::atomic<bool> has_begun{false}, has_ended{false};
    const auto job = [&](int) {
      has_begun = true;
      std::this_thread::sleep_for(std::chrono::microseconds(300));
      has_ended = true;
    };
    pool.submit(job);
    wait_for(has_begun);
    std::vector<int> calls(3);
    pool.run([&](int worker) { ++calls[static_cast<std::size_t>(worker)]; });
    REQUIRE(calls == std::vector<int>(3, 1));
    REQUIRE(has_ended);
    REQUIRE(pool.join_submitted());
  }
}

TEST_CASE("a pool of one thread runs no submitted job") {
  ThreadPool pool(1);
  const auto job = [](int) { FAIL("there is no other thread"); };
  pool.submit(job);
  CHECK(!pool.join_submitted());
}

TEST_CASE("an exception of a submitted job reaches the caller of join_submitted once") {
  ThreadPool pool(3);
  for (int round = 0; round < 20; ++round) {
    std::atomic<bool> has_begun{false};
    const auto bad = [&](int) {
      has_begun = true;
      throw std::runtime_error("bad job");
    };
    pool.submit(bad);
    wait_for(has_begun);
    CHECK_THROWS_AS(pool.join_submitted(), std::runtime_error);
    int calls = 0;
    const auto good = [&](int) { ++calls; };
    pool.submit(good);
    CHECK(calls == (pool.join_submitted() ? 1 : 0));
    pool.run([](int) {});
  }
}

TEST_CASE("exceptions of a submitted job and of jobs beside it do not mix") {
  ThreadPool pool(3);
  for (int round = 0; round < 40; ++round) {
    std::atomic<bool> has_begun{false}, may_end{false};
    const auto bad = [&](int) {
      has_begun = true;
      while (round % 2 == 0 && !may_end) std::this_thread::yield();
      throw std::runtime_error("handed out");
    };
    pool.submit(bad);
    wait_for(has_begun);
    CHECK_THROWS_AS(pool.run_optional([](int) { throw std::logic_error("offered"); }),
                    std::logic_error);
    CHECK_THROWS_AS(pool.parallel_for(100, 1,
                                      [](std::size_t first, std::size_t, int) {
                                        if (first == 7) throw std::logic_error("in pieces");
                                      }),
                    std::logic_error);
    pool.run_optional([](int) {});
    may_end = true;
    CHECK_THROWS_AS(pool.join_submitted(), std::runtime_error);
    pool.run([](int) {});
  }
}

TEST_CASE("every worker runs a job once, awake or asleep") {
  const int threads = GENERATE(1, 2, 3, 16);
  ThreadPool pool(threads);
  for (int round = 0; round < 60; ++round) {
    std::vector<int> calls(
        static_cast<std::size_t>(threads));  // not atomic: the pool orders the accesses
    pool.run([&](int worker) { ++calls[static_cast<std::size_t>(worker)]; });
    REQUIRE(calls == std::vector<int>(static_cast<std::size_t>(threads), 1));
    if (round % 10 == 0) wait_until_workers_sleep();
  }
}

TEST_CASE("a prewoken pool runs its jobs whether they come or not") {
  ThreadPool pool(4);
  for (int round = 0; round < 40; ++round) {
    if (round % 4 < 2) wait_until_workers_sleep();
    pool.prewake();
    if (round % 4 == 1) pool.prewake();
    if (round % 8 == 3) continue;
    std::vector<int> calls(4);
    pool.run([&](int worker) { ++calls[static_cast<std::size_t>(worker)]; });
    REQUIRE(calls == std::vector<int>(4, 1));
  }
  wait_until_workers_sleep();
  pool.prewake();
}

TEST_CASE("with the policy awake sleeping workers sleep on and a job for all wakes them") {
  ThreadPool pool(3);
  for (int round = 0; round < 200; ++round) {
    const bool asleep = round % 20 == 0;
    pool.set_wake_policy(ThreadPool::WakePolicy::awake);
    while (asleep && pool.available() > 1) wait_until_workers_sleep();
    const int available = pool.available();
    REQUIRE(available >= 1);
    REQUIRE(available <= 3);
    std::vector<int> calls(3);  // not atomic: the pool orders the accesses
    pool.prewake();
    pool.run_optional([&](int worker) { ++calls[static_cast<std::size_t>(worker)]; });
    REQUIRE(calls[0] == 1);
    REQUIRE(std::max(calls[1], calls[2]) <= 1);
    if (asleep) {
      REQUIRE(available == 1);
      REQUIRE(calls == std::vector<int>{1, 0, 0});
    }
    std::vector<int> done(1000);
    pool.parallel_for(1000, 10, [&](std::size_t first, std::size_t last, int) {
      for (std::size_t i = first; i < last; ++i) ++done[i];
    });
    REQUIRE(done == std::vector<int>(1000, 1));
    if (round % 3 == 0) {
      calls.assign(3, 0);
      pool.run([&](int worker) { ++calls[static_cast<std::size_t>(worker)]; });
      REQUIRE(calls == std::vector<int>(3, 1));
    }
    pool.set_wake_policy(ThreadPool::WakePolicy::everyone);
    REQUIRE(pool.available() == 3);
  }
}

TEST_CASE("worker 0 is the calling thread") {
  ThreadPool pool(3);
  std::thread::id worker_0;
  pool.run([&](int worker) {
    if (worker == 0) worker_0 = std::this_thread::get_id();
  });
  CHECK(worker_0 == std::this_thread::get_id());
}

TEST_CASE("an optional job runs on worker 0 and at most once on each other worker") {
  ThreadPool pool(4);
  for (int round = 0; round < 500; ++round) {
    std::vector<int> calls(4);
    pool.run_optional([&](int worker) { ++calls[static_cast<std::size_t>(worker)]; });
    REQUIRE(calls[0] == 1);
    for (int count : calls) REQUIRE(count <= 1);
    if (round % 100 == 0) wait_until_workers_sleep();
  }
}

TEST_CASE("parallel_for passes each index once in parts no larger than the grain") {
  const int threads = GENERATE(1, 2, 7);
  const std::size_t count =
      GENERATE(std::size_t{0}, std::size_t{1}, std::size_t{7}, std::size_t{1000});
  const std::size_t grain =
      GENERATE(std::size_t{0}, std::size_t{1}, std::size_t{7}, std::size_t{999});
  ThreadPool pool(threads);
  std::vector<int> calls(count);  // not atomic: the pieces are disjoint
  std::atomic<bool> small{true};
  pool.parallel_for(count, grain, [&](std::size_t first, std::size_t last, int worker) {
    if (worker < 0 || worker >= threads) small = false;
    if (threads > 1 && last - first > std::max<std::size_t>(grain, 1)) small = false;
    for (std::size_t i = first; i < last; ++i) ++calls[i];
  });
  CHECK(calls == std::vector<int>(count, 1));
  CHECK(small);
}

TEST_CASE(
    "an exception of any worker reaches the caller after all have left and the pool goes on") {
  const int threads = GENERATE(1, 4);
  ThreadPool pool(threads);
  for (int bad = 0; bad < threads; ++bad) {
    std::atomic<int> inside{0};
    CHECK_THROWS_AS(pool.run([&](int worker) {
      ++inside;
      if (worker == bad) {
        --inside;
        throw std::runtime_error("bad worker");
      }
      std::this_thread::yield();
      --inside;
    }),
                    std::runtime_error);
    CHECK(inside == 0);
    CHECK_THROWS_AS(pool.parallel_for(1000, 1,
                                      [&](std::size_t first, std::size_t, int) {
                                        if (first == 0) throw std::runtime_error("bad index");
                                      }),
                    std::runtime_error);
  }
  int calls = 0;
  pool.run_optional([&](int worker) {
    if (worker == 0) ++calls;
  });
  CHECK(calls == 1);
}

TEST_CASE("a caller that is done first sleeps until the last worker is") {
  ThreadPool pool(2);
  bool finished = false;
  pool.run([&](int worker) {
    if (worker == 0) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    finished = true;
  });
  CHECK(finished);
}

TEST_CASE("pools are destroyed safely with or without jobs and with threads awake or asleep") {
  for (int round = 0; round < 20; ++round) {
    ThreadPool unused(3);
    ThreadPool used(3);
    std::atomic<int> calls{0};
    used.run([&](int) { ++calls; });
    REQUIRE(calls == 3);
    if (round % 2 == 0) wait_until_workers_sleep();
  }
}

TEST_CASE("a job may use another pool") {
  ThreadPool outer(2);
  ThreadPool inner[2];
  std::atomic<int> calls{0};
  outer.run(
      [&](int worker) { inner[static_cast<std::size_t>(worker)].run([&](int) { ++calls; }); });
  CHECK(calls == inner[0].size() + inner[1].size());
}

TEST_CASE("a pool that gives way runs every job while other threads want all cores") {
  std::atomic<bool> is_over{false};
  std::vector<std::thread> others;
  for (int i = 0; i < 2 * ThreadPool(0).size(); ++i)
    others.emplace_back([&] {
      while (!is_over) {
      }
    });
  ThreadPool pool(3);
  pool.set_gives_way(true);
  const auto start = std::chrono::steady_clock::now();
  for (int round = 0; std::chrono::steady_clock::now() - start < std::chrono::milliseconds(300);
       ++round) {
    std::atomic<int> sum{0}, calls{0};
    pool.parallel_for(100, 1, [&](std::size_t first, std::size_t last, int) {
      for (std::size_t i = first; i < last; ++i) sum += static_cast<int>(i);
    });
    CHECK(sum == 4950);
    if (round % 16 == 0) pool.run([&](int) { ++calls; });
    CHECK((round % 16 != 0 || calls == 3));
  }
  is_over = true;
  for (std::thread& other : others) other.join();
}
