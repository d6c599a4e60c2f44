// Persistent threads for the stages of a step. A step is a few milliseconds of short parallel
// stages, so waiting is a short spin (between stages) and then sleep (between steps that do not
// follow each other at once).
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>
#include <type_traits>
#include <vector>

namespace lazyccd {

// The calling thread is worker 0, so a pool of one has no thread of its own. Several pools may work
// at once; one pool takes one job at a time, and beside it one that is handed out, from one thread
// at a time. A job must not start another on its own pool, but for the one that is handed out: what
// it offers, or does in pieces, its thread does alone.
class ThreadPool {
 public:
  explicit ThreadPool(int threads = 0);  // 0: as many as the machine has
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int size() const { return size_; }

  // Says that a job comes soon: threads that sleep are awake by then, which takes them as long as a
  // short stage lasts.
  void prewake();

  // Who comes to what is offered and to what is done in pieces.
  enum class WakePolicy {
    everyone,
    awake  // nobody is woken: for what is done sooner than a sleeper would be there
  };
  void set_wake_policy(WakePolicy helpers) { wake_policy_ = helpers; }
  // Workers that may come, the caller among them. Those that are awake may go to sleep just now, or
  // be at what was handed out.
  int available() const {
    if (pool_of_thread_ == this) return 1;
    // Relaxed: a guess, for how to share out.
    return wake_policy_ == WakePolicy::awake ? size_ - sleepers_.load(std::memory_order_relaxed) : size_;
  }

  // job(worker) once on every worker; returns when all have, so it waits for who is at what was
  // handed out. Rethrows the first exception.
  template <class Job>
  void run(Job&& job) {
    start(Attendance::everyone, &invoke<Job>, address(job));
  }

  // job(worker) on worker 0, and on others as they come, be it from what was handed out: who comes
  // after worker 0 has returned is left out, so a short job never waits for a sleeper. For jobs
  // that any one worker can finish alone.
  template <class Job>
  void run_optional(Job&& job) {
    if (available() == 1) return static_cast<void>(job(0));
    start(Attendance::volunteers, &invoke<Job>, address(job));
  }

  // job(worker) once, on the first other thread that comes, while the caller goes on, with the pool
  // too: who comes to the pool comes to this first. Until join_submitted() the job stays where it is,
  // and no other is handed out.
  template <class Job>
  void submit(Job& job) {
    submit(&invoke<Job>, address(job));
  }
  // Waits for what was handed out; rethrows its exception. False where nobody had come to it: then
  // nobody will.
  bool join_submitted();
  // Whether a job is submitted and not joined: then no other can be.
  bool has_submitted() const { return has_submitted_; }

  // body(first, last, worker) over disjoint pieces of [0, count) of at most `grain` (where nobody
  // else is available(), or `count` is no more than that, in one piece). No piece is begun after an
  // exception.
  template <class Body>
  void parallel_for(std::size_t count, std::size_t grain, Body&& body) {
    if (count == 0) return;
    grain = std::max<std::size_t>(grain, 1);
    if (available() == 1 || count <= grain) {
      body(std::size_t{0}, count, 0);
      return;
    }
    std::atomic<std::size_t> next{0};
    run_optional([&](int worker) {
      // Relaxed: the pieces share nothing but the counter; the end of the job orders the results.
      // The look before the step keeps the counter from running on and wrapping.
      while (next.load(std::memory_order_relaxed) < count) {
        const std::size_t first = next.fetch_add(grain, std::memory_order_relaxed);
        if (first >= count) break;
        try {
          body(first, first + std::min(grain, count - first), worker);
        } catch (...) {
          next.store(count, std::memory_order_relaxed);
          throw;
        }
      }
    });
  }

 private:
  enum class Attendance { everyone, volunteers };
  using Invoke = void (*)(void* job, int worker);

  // Where a job is for workers to find. On its own line: they spin on it.
  struct alignas(64) Place {
    std::atomic<std::uint64_t> state{0};  // see the packing in thread_pool.cpp
    Invoke invoke = nullptr;
    void* job = nullptr;
    std::exception_ptr error;  // the first of this job; under mutex_
  };
  // The numbers of the last jobs that a worker has seen.
  struct Seen {
    std::uint64_t offered = 0, submitted = 0;
  };

  template <class Job>
  static void invoke(void* job, int worker) {
    (*static_cast<std::remove_reference_t<Job>*>(job))(worker);
  }
  template <class Job>
  static void* address(Job& job) {
    return const_cast<void*>(static_cast<const void*>(std::addressof(job)));
  }

  void start(Attendance attendance, Invoke function, void* job);
  void submit(Invoke function, void* job);
  void publish(Place& place, Invoke function, void* job);
  void close(Place& place);
  void leave_core_to_caller() noexcept;
  void call(Place& place, int worker) noexcept;
  void worker_main(int worker);
  void wait_for_job(const Seen& seen, std::chrono::microseconds spin);
  void help(Place& place, std::uint64_t job, int worker) noexcept;
  bool enter(Place& place, std::uint64_t job) noexcept;
  void leave(Place& place) noexcept;
  template <class Done>
  void wait_until(const Place& place, Done done);

  // Of which this thread is a worker, but for worker 0.
  static inline thread_local const ThreadPool* pool_of_thread_ = nullptr;

  const int size_;
  std::vector<std::thread> threads_;
  WakePolicy wake_policy_ = WakePolicy::everyone;
  bool has_submitted_ = false;
  int caller_core_ = -1;  // where the threads are kept off

  Place current_;  // to all; with the number that says that the pool is going down
  Place submitted_;

  std::mutex mutex_;
  std::condition_variable wake_;  // sleeping workers
  std::condition_variable done_;  // the sleeping caller
  std::atomic<int> sleepers_{0};  // workers inside wake_.wait
  std::uint64_t prewakes_ = 0;      // how often; under mutex_
  std::atomic<bool> caller_sleeps_{false};
};

/// Sets the wake policy of a pool while it lives; then every worker is woken again.
class ScopedWakePolicy {
 public:
  ScopedWakePolicy(ThreadPool& pool, ThreadPool::WakePolicy policy) : pool_(pool) {
    pool_.set_wake_policy(policy);
  }
  ~ScopedWakePolicy() { pool_.set_wake_policy(ThreadPool::WakePolicy::everyone); }
  ScopedWakePolicy(const ScopedWakePolicy&) = delete;
  ScopedWakePolicy& operator=(const ScopedWakePolicy&) = delete;

 private:
  ThreadPool& pool_;
};

}  // namespace lazyccd
