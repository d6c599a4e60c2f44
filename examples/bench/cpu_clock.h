// Time that the calling thread spent on a processor: for work of one thread, what a wall clock
// would say on an idle machine.
#pragma once

#include <ctime>

namespace lazyccd::bench {

inline double thread_nanoseconds() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e9 * double(now.tv_sec) + double(now.tv_nsec);
}

}  // namespace lazyccd::bench
