#include "host/threads/preemption.h"

#include <algorithm>
#include <cstdio>

#if defined(__linux__)
#include <fcntl.h>
#include <unistd.h>
#endif

namespace lazyccd {
namespace {

// A few of the time slices that a scheduler gives to threads that share a core.
constexpr std::chrono::milliseconds period{12};
// With less work in a period, waiting costs little.
constexpr std::int64_t least_work = 2'000'000;  // nanoseconds
// Of the time of work: a thread that shares its core with one other waits half of it.
constexpr double crowded_share = 0.25;

constexpr std::chrono::milliseconds shortest_absence{50}, longest_absence{1000};
// A thread that works this long after its return was not crowded then.
constexpr std::chrono::milliseconds quiet_time{100};

}  // namespace

PreemptionWatch::~PreemptionWatch() {
#if defined(__linux__)
  if (file_ >= 0) close(file_);
#endif
}

// See proc(5) and the kernel's sched-stats.rst: time on a core, time in a run queue, time slices.
bool PreemptionWatch::read(Times& times) {
#if defined(__linux__)
  if (file_ == not_opened) file_ = open("/proc/thread-self/schedstat", O_RDONLY | O_CLOEXEC);
  char text[80];
  const auto size = file_ < 0 ? -1 : pread(file_, text, sizeof text - 1, 0);
  if (size <= 0) return false;
  text[size] = 0;
  long long on_core = 0, waiting = 0;
  if (std::sscanf(text, "%lld %lld", &on_core, &waiting) != 2) return false;
  times = {on_core, waiting};
  return true;
#else
  static_cast<void>(times);
  return false;
#endif
}

bool PreemptionWatch::is_crowded() {
  const Clock::time_point now = Clock::now();
  Times times;
  if (now - last_look_ < period || !read(times)) return false;
  const bool is_first = last_.on_core == 0;
  const std::int64_t waited = times.waiting - last_.waiting;
  const std::int64_t worked = times.on_core - last_.on_core + waited;
  last_look_ = now;
  last_ = times;
  return !is_first && worked >= least_work &&
         static_cast<double>(waited) > crowded_share * static_cast<double>(worked);
}

std::chrono::milliseconds PreemptionWatch::next_absence() {
  const bool is_again = absence_.count() > 0 && Clock::now() - last_return_ < quiet_time;
  absence_ = is_again ? std::min(2 * absence_, longest_absence) : shortest_absence;
  last_return_ = Clock::now() + absence_;
  return absence_;
}

}  // namespace lazyccd
