// A stopwatch for the times in statistics.
#pragma once

#include <chrono>

namespace lazyccd {

/// Measures wall time from its construction.
class Stopwatch {
 public:
  /// Milliseconds since the last call of lap(), or since the construction.
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double ms = std::chrono::duration<double, std::milli>(now - last_).count();
    last_ = now;
    return ms;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace lazyccd
