// The floating-point mode of a thread: rounding, denormals and traps. Applications set it on the
// thread that steps their world.
#pragma once

#include <thread>

#include "lazyccd/bullet/precision.h"
#include "simd/float_environment.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Mode of the thread that creates the object.
class FloatMode {
 public:
  void set() const { environment_.set(); }
  bool is_of_this_thread() const { return thread_ == std::this_thread::get_id(); }

 private:
  FloatEnvironment environment_;
  std::thread::id thread_ = std::this_thread::get_id();
};

/// Sets another thread's mode on this thread, until the end of the scope. Does nothing on that
/// other thread itself, so that exceptions raised in the scope stay raised.
class WithFloatMode {
 public:
  explicit WithFloatMode(const FloatMode& mode) : is_other_(!mode.is_of_this_thread()) {
    if (is_other_) mode.set();
  }
  ~WithFloatMode() {
    if (is_other_) own_.set();
  }
  WithFloatMode(const WithFloatMode&) = delete;
  WithFloatMode& operator=(const WithFloatMode&) = delete;

 private:
  FloatMode own_;
  bool is_other_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
