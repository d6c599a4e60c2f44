// Notices that other work wants the core of a thread.
#pragma once

#include <chrono>
#include <cstdint>

namespace lazyccd {

/// Watches how long a thread waits for a core although it could go on. Only Linux tells; on other
/// systems no thread seems crowded. Opens a file when it is first asked.
class PreemptionWatch {
 public:
  PreemptionWatch() = default;
  ~PreemptionWatch();
  PreemptionWatch(const PreemptionWatch&) = delete;
  PreemptionWatch& operator=(const PreemptionWatch&) = delete;

  /// Call on the watched thread, after each piece of its work. True if it waited for a core during
  /// a large part of its last milliseconds of work.
  bool is_crowded();
  /// How long a crowded thread should leave its core to the others: longer each time, as long as
  /// it is crowded soon after it returns.
  std::chrono::milliseconds next_absence();

 private:
  using Clock = std::chrono::steady_clock;
  // Of the thread since it began.
  struct Times {
    std::int64_t on_core = 0, waiting = 0;  // nanoseconds
  };
  bool read(Times& times);

  static constexpr int not_opened = -2;
  int file_ = not_opened;  // where the system tells; -1: nowhere
  Times last_;
  Clock::time_point last_look_;
  std::chrono::milliseconds absence_{0};
  Clock::time_point last_return_;
};

}  // namespace lazyccd
