// A pool of persistent threads for the stages of a step. A step is a few milliseconds of short
// parallel stages. So a worker that waits spins for a short time (between stages) and then sleeps
// (between steps that do not follow each other at once).
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

#include "lazyccd/export.h"

namespace lazyccd {

/// Runs jobs on several threads. The calling thread is worker 0, so a pool of one has no thread of
/// its own. Several pools may work at the same time. One pool runs one job at a time and, beside
/// it, one submitted job. One thread at a time may call it. Jobs must not start jobs on the same
/// pool. Exception: a submitted job may call run_optional() and parallel_for(); they then run
/// serially on its own thread.
class ThreadPool {
 public:
  explicit ThreadPool(int threads = 0);  ///< 0: as many as cores that the caller may use
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int size() const { return size_; }
  /// The number of threads that a pool of `threads` has; 0: as many as cores that the caller may
  /// use.
  static int resolve(int threads);

  /// Wakes sleeping threads because a job comes soon. Waking takes about as long as a short stage.
  void prewake();

  /// Which workers run_optional() and parallel_for() use.
  enum class WakePolicy {
    everyone,  ///< sleeping workers are woken
    awake      ///< only workers that are awake: for work that is done before a sleeper would wake
  };
  void set_wake_policy(WakePolicy policy) { wake_policy_ = policy; }
  /// Whether a worker stays away for some time when other work wants its core. A machine that is
  /// busy otherwise does the work sooner on fewer threads: nobody waits for a thread without a
  /// core. run() calls such workers back. Off at first. Set it before the first job.
  void set_gives_way(bool gives_way) { gives_way_ = gives_way; }
  /// Whether run_optional() and parallel_for() run on the calling thread alone and prewake() wakes
  /// nobody: for steps in which other threads would not help. Off at first.
  void set_caller_only(bool caller_only) { caller_only_ = caller_only; }

  /// Number of workers that may take part, including the caller. An estimate: a worker that is
  /// awake may just go to sleep, or be busy with a submitted job.
  int available() const {
    if (is_serial()) return 1;
    // Relaxed: an estimate, used only to split the work.
    const int present = size_ - away_.load(std::memory_order_relaxed);
    if (wake_policy_ == WakePolicy::everyone) return present;
    // The counts are not of one moment: a worker that comes back may be in both.
    return std::max(1, present - sleepers_.load(std::memory_order_relaxed));
  }

  /// Whether run_optional() and parallel_for() certainly run on the calling thread alone: also if
  /// a sleeping worker wakes now.
  bool is_serial() const { return size_ == 1 || pool_of_thread_ == this || caller_only_; }

  /// Calls job(worker) once on every worker and waits for all of them, so also for a worker that is
  /// busy with a submitted job. Rethrows the first exception.
  template <class Job>
  void run(Job&& job) {
    start(Attendance::everyone, &invoke<Job>, address(job));
  }

  /// Calls job(worker) on worker 0, and on other workers that come before worker 0 has returned.
  /// Later ones are left out, so a short job never waits for a sleeping worker. For jobs that any
  /// single worker can finish alone. Rethrows the first exception.
  template <class Job>
  void run_optional(Job&& job) {
    if (available() == 1) return static_cast<void>(job(0));
    start(Attendance::optional, &invoke<Job>, address(job));
  }

  /// Calls job(worker) once, on the first other worker that comes, while the caller goes on. The
  /// caller may go on using the pool; workers take the submitted job first. `job` must stay at its
  /// address until join_submitted(), and no other job may be submitted before that. With one thread
  /// the job does not run.
  template <class Job>
  void submit(Job& job) {
    submit(&invoke<Job>, address(job));
  }
  /// Waits for the submitted job and rethrows its exception. Returns false if no worker had started
  /// it; then it will not run.
  bool join_submitted();
  /// Whether a job is submitted and not joined. Then no other job can be submitted.
  bool has_submitted() const { return has_submitted_; }

  /// Calls body(first, last, worker) over disjoint ranges of [0, count), each of at most `grain`
  /// elements. Uses one range of any size if no other worker is available(). After an exception no
  /// range is started; the first exception is rethrown.
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
      // Relaxed: the ranges share nothing but the counter; the end of the job orders the results.
      // The check before the increment keeps the counter from growing without limit and wrapping
      // around.
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
  enum class Attendance { everyone, optional };
  using Invoke = void (*)(void* job, int worker);

  // Holds a published job. On its own cache line, because the workers spin on it.
  struct alignas(64) JobSlot {
    std::atomic<std::uint64_t> state{0};  // see the packing in thread_pool.cpp
    std::atomic<bool> needs_everyone{false};
    Invoke invoke = nullptr;
    void* job = nullptr;
    std::exception_ptr error;  // the first exception of this job; guarded by mutex_
  };
  // Numbers of the last jobs that a worker has seen.
  struct Seen {
    std::uint64_t current = 0, submitted = 0;
  };

  template <class Job>
  static void invoke(void* job, int worker) {
    (*static_cast<std::remove_reference_t<Job>*>(job))(worker);
  }
  template <class Job>
  static void* address(Job& job) {
    return const_cast<void*>(static_cast<const void*>(std::addressof(job)));
  }

  LAZYCCD_API void start(Attendance attendance, Invoke function, void* job);
  void submit(Invoke function, void* job);
  void publish(JobSlot& slot, Attendance attendance, Invoke function, void* job);
  void close(JobSlot& slot);
  void leave_core_to_caller() noexcept;
  void call(JobSlot& slot, int worker) noexcept;
  void worker_main(int worker);
  void wait_for_job(const Seen& seen);
  void stay_away(std::chrono::milliseconds time, const Seen& seen);
  void help(JobSlot& slot, std::uint64_t job, int worker) noexcept;
  bool enter(JobSlot& slot, std::uint64_t job) noexcept;
  void leave(JobSlot& slot) noexcept;
  template <class Done>
  void wait_until(const JobSlot& slot, Done done);

  // The pool of which this thread is a worker other than worker 0, or null.
  static inline thread_local const ThreadPool* pool_of_thread_ = nullptr;

  int size_ = 1;
  std::vector<std::thread> threads_;
  WakePolicy wake_policy_ = WakePolicy::everyone;
  std::atomic<bool> gives_way_{false};
  bool caller_only_ = false;  // is_serial() reads it last, so only on the calling thread
  bool has_submitted_ = false;
  int caller_core_ = -1;  // core that the threads stay away from; -1: none

  JobSlot current_;  // the job for all workers; its number also tells them that the pool ends
  JobSlot submitted_;

  std::mutex mutex_;
  std::condition_variable wake_;  // sleeping workers
  std::condition_variable done_;  // the sleeping caller
  std::condition_variable back_;  // workers that stay away
  std::atomic<int> away_{0};      // their number
  std::atomic<int> sleepers_{0};  // workers inside wake_.wait
  std::uint64_t prewakes_ = 0;    // number of calls of prewake(); guarded by mutex_
  std::atomic<bool> caller_sleeps_{false};
};

/// Sets the wake policy of a pool. The destructor sets it back to WakePolicy::everyone.
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
