// The floating-point mode of a thread: rounding, denormals and traps. Applications set it on the
// thread that steps their world.
#pragma once

#include <optional>
#include <thread>

#include "lazyccd/bullet/precision.h"
#include "simd/float_environment.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Mode of the thread that creates the object.
class FloatMode {
 public:
  const FloatEnvironment& environment() const { return environment_; }
  bool is_of_this_thread() const { return thread_ == std::this_thread::get_id(); }

 private:
  FloatEnvironment environment_;
  std::thread::id thread_ = std::this_thread::get_id();
};

/// Sets another thread's mode on this thread, until the end of the scope. Does nothing on that
/// other thread itself, so that exceptions raised in the scope stay raised.
class WithFloatMode {
 public:
  explicit WithFloatMode(const FloatMode& mode) {
    if (!mode.is_of_this_thread()) environment_.emplace(mode.environment());
  }

 private:
  std::optional<WithFloatEnvironment> environment_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
