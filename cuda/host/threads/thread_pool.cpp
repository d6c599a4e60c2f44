#include "host/threads/thread_pool.h"

#include <chrono>
#include <system_error>
#include <utility>

#if defined(__linux__)
#include <pthread.h>
#include <sched.h>
#endif

#include "core/ieee_arithmetic.h"
#include "host/threads/preemption.h"
#include "host/threads/spin_wait.h"
#include "lazyccd/debug/assert.h"

namespace lazyccd {
namespace {

// Longer than the serial code between two stages of a step, and too short to load the machine.
constexpr std::chrono::microseconds spin_time{40};

// State of a job slot, from the low bits: workers inside the job (16 bits), workers that joined it
// so far (15), whether it is open to join (1), number of the job (32). All in one word, so that
// joining and closing exclude each other by compare-and-swap.
constexpr std::uint64_t one_inside = 1;
constexpr std::uint64_t one_joined = std::uint64_t{1} << 16;
constexpr std::uint64_t open_bit = std::uint64_t{1} << 31;
constexpr int job_shift = 32;
constexpr int max_threads = 1 << 14;

int inside(std::uint64_t state) { return static_cast<int>(state & 0xffff); }
int joined(std::uint64_t state) { return static_cast<int>((state >> 16) & 0x7fff); }
bool is_open(std::uint64_t state) { return (state & open_bit) != 0; }
std::uint64_t job_number(std::uint64_t state) { return state >> job_shift; }

// A number that no job has. It tells the workers that the pool ends.
constexpr std::uint64_t no_more_jobs = 0xffffffff;

// Number of cores that the calling thread may use, and so the threads that it starts.
int core_count() {
#if defined(__linux__)
  cpu_set_t cores;
  if (sched_getaffinity(0, sizeof cores, &cores) == 0) return CPU_COUNT(&cores);
#endif
  return static_cast<int>(std::thread::hardware_concurrency());
}

int thread_count(int wanted) {
  if (wanted <= 0) wanted = core_count();
  return std::clamp(wanted, 1, max_threads);
}

template <class Done>
bool spin_until(Done done) {
  const auto start = std::chrono::steady_clock::now();
  do {
    for (int i = 0; i < 32; ++i) {
      if (done()) return true;
      cpu_relax();
    }
  } while (std::chrono::steady_clock::now() - start < spin_time);
  return done();
}

}  // namespace

int ThreadPool::resolve(int threads) { return thread_count(threads); }

ThreadPool::ThreadPool(int threads) {
  const int wanted = thread_count(threads);
  threads_.reserve(static_cast<std::size_t>(wanted - 1));
  try {
    for (int worker = 1; worker < wanted; ++worker)
      threads_.emplace_back([this, worker] { worker_main(worker); });
  } catch (const std::system_error&) {  // the system has no more threads: fewer do
  }
  size_ = static_cast<int>(threads_.size()) + 1;
}

ThreadPool::~ThreadPool() {
  current_.state.store(no_more_jobs << job_shift, std::memory_order_seq_cst);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    wake_.notify_all();
    back_.notify_all();
  }
  for (std::thread& thread : threads_) thread.join();
}

void ThreadPool::prewake() {
  // Relaxed: a worker that goes to sleep at this moment is woken by the job.
  if (caller_only_ || wake_policy_ != WakePolicy::everyone ||
      sleepers_.load(std::memory_order_relaxed) == 0)
    return;
  leave_core_to_caller();
  const std::lock_guard<std::mutex> lock(mutex_);
  ++prewakes_;
  wake_.notify_all();
}

void ThreadPool::start(Attendance attendance, Invoke function, void* job) {
  if (size_ == 1) {
    function(job, 0);
    return;
  }
  publish(current_, attendance, function, job);
  if (attendance == Attendance::everyone &&
      away_.load(std::memory_order_seq_cst) > 0) {  // see publish()
    const std::lock_guard<std::mutex> lock(mutex_);
    back_.notify_all();
  }
  const bool wakes = attendance == Attendance::everyone || wake_policy_ == WakePolicy::everyone;
  if (wakes && sleepers_.load(std::memory_order_seq_cst) > 0) {  // see publish()
    const std::lock_guard<std::mutex> lock(mutex_);
    wake_.notify_all();
  }
  call(current_, 0);
  if (attendance == Attendance::everyone) {
    wait_until(current_, [&](std::uint64_t s) { return joined(s) == size_ - 1 && inside(s) == 0; });
  }
  close(current_);
}

void ThreadPool::submit(Invoke function, void* job) {
  if (size_ == 1) return;
  LAZYCCD_ASSERT(!has_submitted_, "one job is submitted at a time");
  has_submitted_ = true;
  publish(submitted_, Attendance::optional, function, job);
  if (sleepers_.load(std::memory_order_seq_cst) > 0) {  // see publish()
    const std::lock_guard<std::mutex> lock(mutex_);
    wake_.notify_one();
  }
}

bool ThreadPool::join_submitted() {
  if (size_ == 1) return false;
  has_submitted_ = false;
  close(submitted_);
  return joined(submitted_.state.load(std::memory_order_relaxed)) > 0;
}

void ThreadPool::publish(JobSlot& slot, Attendance attendance, Invoke function, void* job) {
  leave_core_to_caller();
  slot.invoke = function;
  slot.job = job;
  // Relaxed: the state below publishes it.
  slot.needs_everyone.store(attendance == Attendance::everyone, std::memory_order_relaxed);
  // Relaxed: only the thread that starts jobs changes the number.
  std::uint64_t number = job_number(slot.state.load(std::memory_order_relaxed)) + 1;
  if (number == no_more_jobs) number = 0;
  // seq_cst for two reasons. As a release it publishes the job, pairing with the acquire in
  // enter(). And either this thread sees the count of sleepers after it, or the sleeper sees the
  // new job before it sleeps (wait_for_job). The same holds for workers that stay away (stay_away).
  slot.state.store((number << job_shift) | open_bit, std::memory_order_seq_cst);
}

void ThreadPool::close(JobSlot& slot) {
  // Relaxed: closing publishes nothing. After it no worker joins.
  slot.state.fetch_and(~open_bit, std::memory_order_relaxed);
  wait_until(slot, [](std::uint64_t s) { return inside(s) == 0; });
  if (slot.error) std::rethrow_exception(std::exchange(slot.error, nullptr));
}

// Keeps the threads off the caller's core. Some schedulers wake a thread on the core of its waker.
// It waits there until the next load balancing: milliseconds, a whole step. That happened in one of
// three wakes on a virtual machine of two cores. In a large pool one late worker costs little, and
// the system calls would cost more, so large pools are left alone.
void ThreadPool::leave_core_to_caller() noexcept {
#if defined(__linux__)
  constexpr int largest_pool = 16;
  const int core = sched_getcpu();
  if (core == caller_core_ || core < 0 || size_ > largest_pool) return;
  caller_core_ = core;
  cpu_set_t others;
  if (sched_getaffinity(0, sizeof others, &others) != 0) return;
  CPU_CLR(static_cast<std::size_t>(core), &others);
  if (CPU_COUNT(&others) == 0) return;
  for (std::thread& thread : threads_)
    pthread_setaffinity_np(thread.native_handle(), sizeof others, &others);
#endif
}

void ThreadPool::call(JobSlot& slot, int worker) noexcept {
  try {
    slot.invoke(slot.job, worker);
  } catch (...) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!slot.error) slot.error = std::current_exception();
  }
}

template <class Done>
void ThreadPool::wait_until(const JobSlot& slot, Done done) {
  // Acquire, pairs with the release in leave(): the writes of the workers are visible after the
  // job.
  const auto is_done = [&] { return done(slot.state.load(std::memory_order_acquire)); };
  if (spin_until(is_done)) return;
  std::unique_lock<std::mutex> lock(mutex_);
  // seq_cst with leave(): either the leaving worker sees this flag, or this thread sees that it
  // left.
  caller_sleeps_.store(true, std::memory_order_seq_cst);
  done_.wait(lock, [&] { return done(slot.state.load(std::memory_order_seq_cst)); });
  caller_sleeps_.store(false, std::memory_order_relaxed);
}

void ThreadPool::worker_main(int worker) {
  pool_of_thread_ = this;
  const IeeeArithmetic ieee;  // whatever the mode of the thread that made this one
  Seen seen;
  PreemptionWatch watch;
  for (;;) {
    wait_for_job(seen);
    // Acquire, pairs with the store in publish(): a job that was submitted before this one was
    // published is seen below, and is taken first.
    const std::uint64_t current = job_number(current_.state.load(std::memory_order_acquire));
    if (current == no_more_jobs) return;
    // Relaxed: enter() acquires what the job needs.
    const std::uint64_t submitted = job_number(submitted_.state.load(std::memory_order_relaxed));
    if (submitted != seen.submitted) {
      seen.submitted = submitted;
      help(submitted_, submitted, worker);
    } else {
      seen.current = current;
      help(current_, current, worker);
    }
    if (gives_way_.load(std::memory_order_relaxed) && watch.is_crowded())
      stay_away(watch.next_absence(), seen);
  }
}

// Sleeps for some time, unless a job needs every worker or the pool ends.
void ThreadPool::stay_away(std::chrono::milliseconds time, const Seen& seen) {
  std::unique_lock<std::mutex> lock(mutex_);
  away_.fetch_add(1, std::memory_order_seq_cst);  // before the check for a job: see publish()
  back_.wait_for(lock, time, [&] {
    const std::uint64_t job = job_number(current_.state.load(std::memory_order_seq_cst));
    // Relaxed: the state published it with the job, or with a later one.
    return job == no_more_jobs ||
           (job != seen.current && current_.needs_everyone.load(std::memory_order_relaxed));
  });
  away_.fetch_sub(1, std::memory_order_relaxed);
}

// Returns when there is a job other than the last ones seen. Jobs in between may have come and
// gone.
void ThreadPool::wait_for_job(const Seen& seen) {
  const auto has_come = [&](std::memory_order order) {
    return job_number(current_.state.load(order)) != seen.current ||
           job_number(submitted_.state.load(order)) != seen.submitted;
  };
  // Relaxed: the caller acquires when it looks for the job.
  while (!spin_until([&] { return has_come(std::memory_order_relaxed); })) {
    std::unique_lock<std::mutex> lock(mutex_);
    const std::uint64_t old_prewakes = prewakes_;
    // seq_cst, before the check for a job: see publish().
    sleepers_.fetch_add(1, std::memory_order_seq_cst);
    wake_.wait(lock,
               [&] { return old_prewakes != prewakes_ || has_come(std::memory_order_seq_cst); });
    sleepers_.fetch_sub(1, std::memory_order_relaxed);
  }
}

void ThreadPool::help(JobSlot& slot, std::uint64_t job, int worker) noexcept {
  if (!enter(slot, job)) return;
  call(slot, worker);
  leave(slot);
}

// Joins the job. Returns false if it is over, or if another worker has the submitted job.
bool ThreadPool::enter(JobSlot& slot, std::uint64_t job) noexcept {
  std::uint64_t state = slot.state.load(std::memory_order_relaxed);
  while (job_number(state) == job && is_open(state)) {
    std::uint64_t joined_state = state + one_inside + one_joined;
    if (&slot == &submitted_) joined_state &= ~open_bit;
    // Acquire, pairs with the store in publish(): the fields of the slot belong to this job.
    if (slot.state.compare_exchange_weak(state, joined_state, std::memory_order_acquire,
                                         std::memory_order_relaxed))
      return true;
  }
  return false;
}

void ThreadPool::leave(JobSlot& slot) noexcept {
  // Release, pairs with the acquire in wait_until(); seq_cst for the flag below.
  slot.state.fetch_sub(one_inside, std::memory_order_seq_cst);
  if (caller_sleeps_.load(std::memory_order_seq_cst)) {
    const std::lock_guard<std::mutex> lock(mutex_);
    done_.notify_one();
  }
}

}  // namespace lazyccd
