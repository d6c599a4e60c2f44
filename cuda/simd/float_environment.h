// The floating-point environment of a thread: rounding, denormals, traps and raised exceptions.
#pragma once

#include <cfenv>

#if defined(_WIN32) && (defined(__SSE2__) || defined(_M_X64))
#define LAZYCCD_SAVES_MXCSR
#include <immintrin.h>
#endif

namespace lazyccd {

/// Environment of the thread that creates the object; set() gives it to any thread.
class FloatEnvironment {
 public:
  FloatEnvironment() { std::fegetenv(&environment_); }
  void set() const {
    std::fesetenv(&environment_);
#if defined(LAZYCCD_SAVES_MXCSR)
    _mm_setcsr(mxcsr_);
#endif
  }

 private:
  std::fenv_t environment_;
#if defined(LAZYCCD_SAVES_MXCSR)
  // fesetenv() of MinGW-w64 sets the x87 unit alone.
  unsigned mxcsr_ = _mm_getcsr();
#endif
};

/// Gives the thread another environment until the end of the scope.
class WithFloatEnvironment {
 public:
  explicit WithFloatEnvironment(const FloatEnvironment& environment) { environment.set(); }
  ~WithFloatEnvironment() { own_.set(); }
  WithFloatEnvironment(const WithFloatEnvironment&) = delete;
  WithFloatEnvironment& operator=(const WithFloatEnvironment&) = delete;

 private:
  FloatEnvironment own_;  // saved before the constructor sets the other one
};

}  // namespace lazyccd
