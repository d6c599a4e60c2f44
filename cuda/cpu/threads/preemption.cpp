#include "cpu/threads/preemption.h"

#include <algorithm>

#if defined(__linux__)
#include <sys/resource.h>
#endif

namespace lazyccd {
namespace {

// About the time that a scheduler gives to one of several threads on a core.
constexpr std::chrono::milliseconds period{4};

constexpr std::chrono::milliseconds shortest_absence{50}, longest_absence{1000};

// A thread that works this long after its return was not crowded then.
constexpr std::chrono::milliseconds quiet_time{100};

// Number of times that the calling thread lost its core so far; -1: the system does not tell.
long involuntary_switches() {
#if defined(__linux__)
  rusage usage;
  if (getrusage(RUSAGE_THREAD, &usage) == 0) return usage.ru_nivcsw;
#endif
  return -1;
}

}  // namespace

bool PreemptionWatch::is_crowded() {
  const Clock::time_point now = Clock::now();
  if (now - last_look_ < period) return false;
  const long switches = involuntary_switches();
  const bool was_lost = switches > switches_ && switches_ >= 0;
  last_look_ = now;
  switches_ = switches;
  // Three of the last four looks. A single one is often the system's own work.
  crowded_ = (crowded_ << 1 | (was_lost ? 1 : 0)) & 0xf;
  return crowded_ == 0x7 || crowded_ == 0xb || crowded_ == 0xd || crowded_ >= 0xe;
}

std::chrono::milliseconds PreemptionWatch::next_absence() {
  const bool is_again = absence_.count() > 0 && Clock::now() - last_return_ < quiet_time;
  absence_ = is_again ? std::min(2 * absence_, longest_absence) : shortest_absence;
  last_return_ = Clock::now() + absence_;
  crowded_ = 0x3;  // one more loss tells that nothing has changed
  return absence_;
}

}  // namespace lazyccd
