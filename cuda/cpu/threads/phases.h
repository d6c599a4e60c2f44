// Runs phases of independent items on a pool, with a serial step between two phases.
//
// Each worker has a part of the items, the same part in every phase, so that what it has written in
// one phase is still in its cache in the next. A worker that is done takes items of the others. Any
// thread can do all of the work, so a thread that comes late, or not at all, holds up nobody. There
// is no barrier object, and no fork and join for each phase (compare Jolt's LargeIslandSplitter).
#pragma once

#include <atomic>
#include <cfenv>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>

#include "cpu/threads/spin_wait.h"
#include "cpu/threads/thread_pool.h"

namespace lazyccd {

/// One run of all phases. `Run` is called as run(item, worker) and `Next` as next(); see
/// Threads::run_phases().
template <class Run, class Next>
class Phases {
 public:
  Phases(const Run& run, const Next& next) : run_(run), next_(next) {}

  void start(ThreadPool& pool, std::size_t count) {
    if (pool.available() == 1) {
      for (; count > 0; count = next_())
        for (std::size_t item = 0; item < count; ++item) run_(item, 0);
      return;
    }
    if (count == 0) return;
    workers_ = static_cast<std::uint64_t>(pool.size());
    parts_ = std::make_unique<Part[]>(workers_);
    begin_phase(1, count);
    std::fegetenv(&caller_mode_);
    pool.run_optional([this](int worker) {
      // All items run in the caller's floating-point mode: rounding, denormals and traps.
      std::fenv_t own_mode;
      std::fegetenv(&own_mode);
      if (worker != 0) std::fesetenv(&caller_mode_);
      work(worker);
      if (worker != 0) std::fesetenv(&own_mode);
    });
    if (error_) std::rethrow_exception(error_);
  }

 private:
  // Two numbers in a word: that of a phase above, and below an item or the count of items. Phases
  // are counted from 1. A phase without items ends the run.
  static constexpr int phase_shift = 32;
  static std::uint64_t pack(std::uint64_t phase, std::uint64_t low) {
    return phase << phase_shift | low;
  }
  static std::uint64_t phase_of(std::uint64_t word) { return word >> phase_shift; }
  static std::uint64_t low_of(std::uint64_t word) { return word & 0xffffffff; }

  // The items [first, last) of one worker.
  struct alignas(64) Part {
    std::atomic<std::uint64_t> next{0};  // phase, and its next item; an earlier phase: none yet
  };

  void begin_phase(std::uint64_t phase, std::uint64_t count) {
    // Relaxed: the release below publishes it.
    open_.store(static_cast<std::int64_t>(count), std::memory_order_relaxed);
    // Release, pairs with the acquire in work(): items see what came before their phase.
    state_.store(pack(phase, count), std::memory_order_release);
  }

  void work(int worker) {
    double waited = 0;
    for (std::uint64_t seen = 0;;) {
      std::uint64_t state;
      {
        SpinWait wait(waited);
        // Acquire, pairs with the release in begin_phase().
        while ((state = state_.load(std::memory_order_acquire)) == seen) wait.pause();
      }
      seen = state;
      if (low_of(state) == 0) return;
      const std::int64_t done = run_items(state, static_cast<std::uint64_t>(worker));
      // Acquire and release: the last one sees what all items have written.
      if (done > 0 && open_.fetch_sub(done, std::memory_order_acq_rel) == done)
        end_phase(phase_of(state));
    }
  }

  // Runs items of the phase until none is left; first those of its own part. Returns their number.
  std::int64_t run_items(std::uint64_t state, std::uint64_t worker) {
    const std::uint64_t phase = phase_of(state), count = low_of(state);
    std::int64_t done = 0;
    for (std::uint64_t i = 0; i < workers_; ++i) {
      const std::uint64_t part = (worker + i) % workers_;
      const std::uint64_t first = part * count / workers_, last = (part + 1) * count / workers_;
      std::uint64_t item;
      while (take(parts_[part], phase, first, last, item)) {
        ++done;
        try {
          if (!failed_.load(std::memory_order_relaxed))
            run_(static_cast<std::size_t>(item), static_cast<int>(worker));
        } catch (...) {
          fail();
        }
      }
    }
    return done;
  }

  // Takes the next item of a part. Returns false if there is none left. All items of a phase are
  // taken before the next phase begins, so a later phase in the word says that too.
  bool take(Part& part, std::uint64_t phase, std::uint64_t first, std::uint64_t last,
            std::uint64_t& item) {
    // Relaxed: the state of the run publishes what the item needs.
    std::uint64_t word = part.next.load(std::memory_order_relaxed);
    do {
      if (phase_of(word) > phase) return false;
      item = phase_of(word) < phase ? first : low_of(word);
      if (item == last) return false;
    } while (
        !part.next.compare_exchange_weak(word, pack(phase, item + 1), std::memory_order_relaxed));
    return true;
  }

  void end_phase(std::uint64_t phase) {
    std::size_t count = 0;
    try {
      if (!failed_.load(std::memory_order_relaxed)) count = next_();
    } catch (...) {
      count = 0;
      fail();
    }
    begin_phase(phase + 1, count);
  }

  void fail() {
    if (!failed_.exchange(true)) error_ = std::current_exception();
  }

  const Run& run_;
  const Next& next_;
  std::uint64_t workers_ = 1;
  std::unique_ptr<Part[]> parts_;  // by worker
  std::fenv_t caller_mode_;
  alignas(64) std::atomic<std::uint64_t> state_{0};  // phase, and the count of its items
  alignas(64) std::atomic<std::int64_t> open_{0};    // items of the phase that have not ended
  std::atomic<bool> failed_{false};
  std::exception_ptr error_;  // written by the thread that sets failed_; read after the run
};

}  // namespace lazyccd
