// Runs phases of independent items on a pool, with a serial step between two phases.
//
// Each worker that has joined has a part of the items. It is the same part in every phase, so that
// what it has written in one phase is still in its cache in the next. A worker that has waited for
// some time takes items of the others. So any thread can do all of the work, and a thread that
// comes late, or not at all, holds up nobody. There is no barrier object, and no fork and join for
// each phase (compare Jolt's LargeIslandSplitter).
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <thread>

#include "host/threads/spin_wait.h"
#include "host/threads/thread_pool.h"
#include "simd/float_environment.h"

namespace lazyccd {

/// One run of all phases. `Run` is called as run(item, worker) and `Next` as next(); see
/// Threads::run_phases().
template <class Run, class Next>
class Phases {
 public:
  Phases(const Run& run, const Next& next) : run_(run), next_(next) {}

  void start(ThreadPool& pool, std::size_t count) {
    for (; count == 1; count = next_()) run_(0, 0);
    if (pool.available() == 1) {
      for (; count > 0; count = next_())
        for (std::size_t item = 0; item < count; ++item) run_(item, 0);
      return;
    }
    if (count == 0) return;
    workers_ = static_cast<std::uint64_t>(pool.size());
    parts_ = std::make_unique<Part[]>(workers_);
    begin_phase(1, count);
    const FloatEnvironment caller_mode;
    pool.run_optional([&](int worker) {
      // All items run in the caller's floating-point mode: rounding, denormals and traps.
      if (worker == 0) return work(worker);
      const WithFloatEnvironment mode(caller_mode);
      work(worker);
    });
    if (error_) std::rethrow_exception(error_);
  }

 private:
  // State of the run: number of the phase (24 bits), its parts (12), its items (28). Phases are
  // counted from 1. A phase without items ends the run.
  static constexpr int phase_shift = 40, parts_shift = 28;
  static constexpr std::uint64_t max_parts = 0xfff, max_items = 0xfffffff;
  static std::uint64_t phase_of(std::uint64_t state) { return state >> phase_shift; }
  static std::uint64_t parts_of(std::uint64_t state) { return state >> parts_shift & max_parts; }
  static std::uint64_t items_of(std::uint64_t state) { return state & max_items; }

  // The items of one worker.
  struct alignas(64) Part {
    // Number of a phase, and the next item in it (40 bits). An earlier phase: no item is taken yet.
    std::atomic<std::uint64_t> next{0};
  };

  void begin_phase(std::uint64_t phase, std::uint64_t count) {
    // Relaxed: the release below publishes it. A worker that joins now has its part in later
    // phases.
    open_.store(static_cast<std::int64_t>(count), std::memory_order_relaxed);
    const std::uint64_t parts = std::min(
        {max_parts, workers_, std::max<std::uint64_t>(1, joined_.load(std::memory_order_relaxed))});
    // Release, pairs with the acquire in work(): items see what came before their phase.
    state_.store(phase << phase_shift | parts << parts_shift | count, std::memory_order_release);
  }

  void work(int worker) {
    // Relaxed: a number for each worker that joins.
    const std::uint64_t rank = joined_.fetch_add(1, std::memory_order_relaxed);
    std::uint64_t seen = 0;
    for (int waits = 0;;) {
      // Acquire, pairs with the release in begin_phase().
      const std::uint64_t state = state_.load(std::memory_order_acquire);
      if (items_of(state) == 0 && state != 0) return;
      std::int64_t done = 0;
      if (state != seen) {
        seen = state;
        waits = 0;
        if (rank < parts_of(state)) done = run_part(state, rank, worker);
      } else if (++waits % patience == 0) {
        for (std::uint64_t i = 1; i <= parts_of(state); ++i)
          done += run_part(state, (rank + i) % parts_of(state), worker);
        if (done == 0) std::this_thread::yield();
      } else {
        cpu_relax();
      }
      // Acquire and release: the last one sees what all items have written.
      if (done > 0 && open_.fetch_sub(done, std::memory_order_acq_rel) == done)
        end_phase(phase_of(state), worker);
    }
  }

  // Runs items of a part until none is left. Returns their number.
  std::int64_t run_part(std::uint64_t state, std::uint64_t part, int worker) {
    const std::uint64_t count = items_of(state), parts = parts_of(state);
    const std::uint64_t first = part * count / parts, last = (part + 1) * count / parts;
    std::int64_t done = 0;
    for (std::uint64_t item; take(parts_[part], phase_of(state), first, last, item); ++done) {
      try {
        if (!failed_.load(std::memory_order_relaxed)) run_(static_cast<std::size_t>(item), worker);
      } catch (...) {
        fail();
      }
    }
    return done;
  }

  // Takes the next item of a part. Returns false if there is none left. All items of a phase are
  // taken before the next phase begins, so a later phase in the word says that too.
  bool take(Part& part, std::uint64_t phase, std::uint64_t first, std::uint64_t last,
            std::uint64_t& item) {
    // Relaxed: the state of the run publishes what the item needs.
    constexpr std::uint64_t item_mask = (std::uint64_t{1} << phase_shift) - 1;
    std::uint64_t word = part.next.load(std::memory_order_relaxed);
    do {
      if (phase_of(word) > phase) return false;
      item = phase_of(word) < phase ? first : word & item_mask;
      if (item == last) return false;
    } while (!part.next.compare_exchange_weak(word, phase << phase_shift | (item + 1),
                                              std::memory_order_relaxed));
    return true;
  }

  void end_phase(std::uint64_t phase, int worker) {
    std::size_t count = 0;
    try {
      // A single item is run here: to hand it over takes longer than most such items do.
      while (!failed_.load(std::memory_order_relaxed) && (count = next_()) == 1) run_(0, worker);
    } catch (...) {
      fail();
    }
    begin_phase(phase + 1, failed_.load(std::memory_order_relaxed) ? 0 : count);
  }

  void fail() {
    if (!failed_.exchange(true)) error_ = std::current_exception();
  }

  // Looks at the state after which a waiting worker takes items of others, and yields its core.
  // Longer than most phases take, so that items stay where they are.
  static constexpr int patience = 1024;

  const Run& run_;
  const Next& next_;
  std::uint64_t workers_ = 1;
  std::unique_ptr<Part[]> parts_;         // by worker
  std::atomic<std::uint64_t> joined_{0};  // workers that have come
  alignas(64) std::atomic<std::uint64_t> state_{0};
  alignas(64) std::atomic<std::int64_t> open_{0};  // items of the phase that have not ended
  std::atomic<bool> failed_{false};
  std::exception_ptr error_;  // written by the thread that sets failed_; read after the run
};

}  // namespace lazyccd
