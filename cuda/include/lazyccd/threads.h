// Threads that detectors and their caller share.
#pragma once

#include <cstddef>
#include <memory>
#include <type_traits>
#include <utility>

#include "lazyccd/export.h"

namespace lazyccd {

template <class Signature>
class FunctionRef;

/// Refers to something that can be called, such as a lambda, which must outlive it. Copies and
/// allocates nothing, so it is for parameters that are called before the function returns. As
/// std::function_ref of C++26.
template <class Result, class... Arguments>
class FunctionRef<Result(Arguments...)> {
 public:
  template <class Callable,
            class = std::enable_if_t<!std::is_same_v<std::decay_t<Callable>, FunctionRef> &&
                                     std::is_invocable_r_v<Result, Callable&, Arguments...>>>
  FunctionRef(Callable&& callable)  // NOLINT: converts like std::function
      : object_(const_cast<void*>(static_cast<const void*>(std::addressof(callable)))),
        call_([](void* object, Arguments... arguments) -> Result {
          return (*static_cast<std::remove_reference_t<Callable>*>(object))(
              std::forward<Arguments>(arguments)...);
        }) {}

  Result operator()(Arguments... arguments) const {
    return call_(object_, std::forward<Arguments>(arguments)...);
  }

 private:
  void* object_;
  Result (*call_)(void*, Arguments...);
};

class CpuDetector;
class Detector;
class ThreadPool;

/// A pool of threads. Copies share it; the last copy ends the threads. One caller at a time. Of the
/// detectors that share it, one at a time detects ahead; the others do all their work in detect().
class LAZYCCD_API Threads {
 public:
  /// `count` threads, the caller's included; 0: as many as cores that the caller may use, without
  /// those that are busy with other work. Throws Error if negative. They start with the first call
  /// of another function, and are fewer if the system has no more.
  explicit Threads(int count = 0);

  int count() const { return count_; }
  /// Whether all work runs on the calling thread, as with a count of 1, and no other thread is
  /// woken; for all copies. A detection that was started ahead goes on. Results do not depend on
  /// it. Off at first.
  void set_caller_only(bool caller_only) const;
  bool is_caller_only() const;

  /// Calls body(first, last) over disjoint ranges of [0, count), each of at most `grain` elements.
  /// Runs on the calling thread alone, in one range, if there is one thread, or if count <= 3 *
  /// grain and the workers are asleep. All ranges run in the caller's floating-point mode. Rethrows
  /// the first exception.
  void parallel_for(std::size_t count, std::size_t grain,
                    FunctionRef<void(std::size_t first, std::size_t last)> body) const;

  /// Runs phases of independent items. Calls run(item, worker) for the items 0 .. count - 1 of the
  /// first phase, then next() once, which returns the count of the next phase, and so on until it
  /// returns 0. All writes of a phase are visible in next() and in the next phase. `worker` is
  /// below count(); no two threads have the same one at a time. A phase has less than 2^28 items.
  /// One item alone is not handed over to another thread. All items run in the caller's
  /// floating-point mode. After an exception nothing more is called; the first one is rethrown.
  void run_phases(std::size_t count, FunctionRef<void(std::size_t item, int worker)> run,
                  FunctionRef<std::size_t()> next) const;

 private:
  friend class CpuDetector;
  friend class Detector;

  ThreadPool& pool() const;  // starts the threads if needed

  int count_;
  bool gives_way_;
  std::shared_ptr<std::unique_ptr<ThreadPool>> pool_;  // null inside until it is needed
};

}  // namespace lazyccd
