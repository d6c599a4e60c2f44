#include "util/scratch_vector.h"

#include <thread>
#include <utility>

#include "plugin/support/allocations.h"
#include "support/catch.h"
#include "support/test_budget.h"

using namespace lazyccd::test;
using lazyccd::bullet::ScratchVector;

TEST_CASE("a scratch vector has the memory of one before it") {
  if (is_sanitized) return;  // nothing is counted
  const int* before = nullptr;
  {
    const ScratchVector<int> first(100, 1);
    before = first.data();
  }
  const long count = allocation_count();
  const ScratchVector<int> second(90, 2);
  const long allocated = allocation_count() - count;  // before CHECK, as some reporters allocate
  CHECK(allocated == 0);
  CHECK(second.data() == before);
  CHECK(second.back() == 2);
}

TEST_CASE("scratch vectors that end on another thread leave nothing there") {
  if (is_sanitized) return;  // nothing is counted
  constexpr std::size_t size = 100000;
  ScratchVector<int> made(size, 1);
  long allocated = 0;
  std::thread([&] {
    { const ScratchVector<int> ends = std::move(made); }
    const long count = allocation_count();
    const ScratchVector<int> own(size, 2);
    allocated = allocation_count() - count;
  }).join();
  CHECK(allocated == 1);
}
