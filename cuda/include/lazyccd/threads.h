// Threads that detectors and their caller share.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace lazyccd {

class CpuDetector;
class Detector;
class ThreadPool;

/// A pool of threads. Copies share it; the last copy ends the threads. One caller at a time. Of the
/// detectors that share it, one at a time detects ahead; the others do all their work in detect().
class Threads {
 public:
  /// `count` threads, the caller's included; 0: as many as the machine has. Throws Error if
  /// negative. They start when they are first needed, and are fewer if the system has no more.
  explicit Threads(int count = 0);

  int count() const { return count_; }

  /// Calls body(first, last) over disjoint ranges of [0, count), each of at most `grain` elements.
  /// Runs on the calling thread alone, in one range, if there is one thread, or if count <= 3 *
  /// grain and the workers are asleep. Rethrows the first exception.
  void parallel_for(std::size_t count, std::size_t grain,
                    const std::function<void(std::size_t first, std::size_t last)>& body) const;

 private:
  friend class CpuDetector;
  friend class Detector;

  ThreadPool& pool() const;  // starts the threads if needed

  int count_;
  std::shared_ptr<std::unique_ptr<ThreadPool>> pool_;  // null inside until it is needed
};

}  // namespace lazyccd
