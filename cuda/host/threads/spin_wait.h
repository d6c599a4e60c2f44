// Spin waiting of a thread, with a measurement of the time spent.
#pragma once

#include <chrono>
#include <thread>

#if defined(__x86_64__) || defined(_M_X64)
#include <immintrin.h>
#endif

namespace lazyccd {

/// Tells the core that this is a spin loop: saves power and lets a sibling hyperthread run.
inline void cpu_relax() {
#if defined(__x86_64__) || defined(_M_X64)
  _mm_pause();
#elif defined(__aarch64__) && (defined(__GNUC__) || defined(__clang__))
  asm volatile("yield");
#endif
}

/// One wait. The destructor adds the time since the first pause() to `milliseconds`.
class SpinWait {
 public:
  explicit SpinWait(double& milliseconds) : milliseconds_(milliseconds) {}
  SpinWait(const SpinWait&) = delete;
  SpinWait& operator=(const SpinWait&) = delete;
  ~SpinWait() {
    if (pauses_ != 0)
      milliseconds_ += std::chrono::duration<double, std::milli>(Clock::now() - start_).count();
  }

  /// Waits a little: first by spinning, because work usually comes within microseconds. After 256
  /// calls it yields, because the other threads may need the core.
  void pause() {
    if (pauses_ == 0) start_ = Clock::now();
    if (++pauses_ < 256) {
      cpu_relax();
    } else {
      std::this_thread::yield();
    }
  }

 private:
  using Clock = std::chrono::steady_clock;
  double& milliseconds_;
  Clock::time_point start_;
  long pauses_ = 0;
};

}  // namespace lazyccd
