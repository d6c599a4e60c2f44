// When the exact stage is launched ahead.
#include "core/exact/stage_policy.h"

#include "support/catch.h"

using lazyccd::exact::StagePolicy;

TEST_CASE("the exact stage is left out until a step needs it") {
  StagePolicy policy;
  CHECK(!policy.launches_ahead());
  for (int step = 0; step < 100; ++step) policy.record(0);
  CHECK(!policy.launches_ahead());
  policy.record(1);
  CHECK(policy.launches_ahead());
}

TEST_CASE("the exact stage stays while it is needed now and then, and leaves after a while") {
  StagePolicy policy;
  for (int step = 0; step < 200; ++step) {
    policy.record(step % StagePolicy::kPatience == 0 ? 7 : 0);
    CHECK(policy.launches_ahead());
  }
  policy.record(std::uint64_t{1} << 40);
  for (int step = 0; step < StagePolicy::kPatience; ++step) {
    CHECK(policy.launches_ahead());
    policy.record(0);
  }
  CHECK(!policy.launches_ahead());
}
