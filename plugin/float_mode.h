// How a thread computes: rounding, denormals and traps, which applications set on the thread that
// steps their world.
#pragma once

#include <cfenv>

#include "lazyccd/bullet/precision.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

// Of the thread that makes it.
class FloatMode {
 public:
  FloatMode() { std::fegetenv(&mode_); }
  void set() const { std::fesetenv(&mode_); }

 private:
  std::fenv_t mode_;
};

// This thread computes as another one for as long as it lives.
class WithFloatMode {
 public:
  explicit WithFloatMode(const FloatMode& mode) { mode.set(); }
  ~WithFloatMode() { own_.set(); }
  WithFloatMode(const WithFloatMode&) = delete;
  WithFloatMode& operator=(const WithFloatMode&) = delete;

 private:
  FloatMode own_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
