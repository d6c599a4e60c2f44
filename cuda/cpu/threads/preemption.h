// Notices that other work wants the core of a thread.
#pragma once

#include <chrono>
#include <cstdint>

namespace lazyccd {

/// Counts how often a thread lost its core although it could have gone on. Only Linux tells; on
/// other systems no thread seems crowded.
class PreemptionWatch {
 public:
  /// Call on the watched thread, after each piece of its work. True if other threads took its core
  /// in most of the last periods of work.
  bool is_crowded();
  /// How long a crowded thread should leave its core to the others: longer each time, as long as
  /// it is crowded whenever it returns.
  std::chrono::milliseconds next_absence();

 private:
  using Clock = std::chrono::steady_clock;

  Clock::time_point last_look_;
  long switches_ = -1;         // involuntary context switches at the last look; -1: not known
  std::uint32_t crowded_ = 0;  // the last looks, the newest in bit 0: the core was lost before it
  std::chrono::milliseconds absence_{0};
  Clock::time_point last_return_;
};

}  // namespace lazyccd
