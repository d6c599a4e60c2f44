// A clock of processor time. For work of one thread it gives about the wall time on an idle
// machine.
#pragma once

#include <ctime>

namespace lazyccd::bench {

/// Returns the processor time that the calling thread has used, nanoseconds.
inline double thread_nanoseconds() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e9 * double(now.tv_sec) + double(now.tv_nsec);
}

}  // namespace lazyccd::bench
