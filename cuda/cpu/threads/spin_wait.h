// How a thread waits for others' work, and for how long it did.
#pragma once

#include <chrono>
#include <thread>

#include "cpu/threads/pause.h"

namespace lazyccd {

// Lives as long as the wait; adds the time from the first pause() to its end.
class Waiting {
 public:
  explicit Waiting(double& milliseconds) : milliseconds_(milliseconds) {}
  Waiting(const Waiting&) = delete;
  Waiting& operator=(const Waiting&) = delete;
  ~Waiting() {
    if (pauses_ != 0)
      milliseconds_ += std::chrono::duration<double, std::milli>(Clock::now() - start_).count();
  }

  // Work comes within microseconds or the others have the cores.
  void pause() {
    if (pauses_ == 0) start_ = Clock::now();
    if (++pauses_ < 256) {
      pause_core();
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
