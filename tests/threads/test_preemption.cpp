#include "host/threads/preemption.h"

#include <chrono>

#include "support/catch.h"

TEST_CASE("a thread that is crowded whenever it returns stays away longer, up to a second") {
  lazyccd::PreemptionWatch watch;
  for (const int expected : {50, 100, 200, 400, 800, 1000, 1000})
    CHECK(watch.next_absence() == std::chrono::milliseconds(expected));
}
