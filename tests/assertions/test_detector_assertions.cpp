// Assertions of the detector that an input can make fail, and the handler of an application.
// tests/assertions/README.md lists all assertions.
#include <atomic>
#include <vector>

#include "assertions/failed_belief.h"
#include "cpu/verlet/verlet_list.h"
#include "host/threads/thread_pool.h"
#include "lazyccd/debug/assert.h"
#include "support/catch.h"

using namespace lazyccd;
using lazyccd::test::failed_belief;

namespace {

// Of the handler. Assertions may fail on several threads.
std::atomic<int> failures{0};
std::atomic<const char*> last_belief{""};

bool count_and_go_on(const FailedAssertion& failed) {
  ++failures;
  last_belief = failed.belief;
  return true;
}

}  // namespace

TEST_CASE("a handler counts what fails, and the process goes on") {
  const AssertHandler before = set_assert_handler(count_and_go_on);
  assertion_failed({"one is two", "1 == 2", "file", 3});
  CHECK(set_assert_handler(before) == count_and_go_on);
  CHECK(failures == 1);
  CHECK(std::string(last_belief) == "one is two");
}

TEST_CASE("a build without assertions evaluates no condition") {
  int evaluated = 0;
  const auto holds = [&] { return ++evaluated > 0; };
  LAZYCCD_ASSERT(holds(), "the condition holds");
  CHECK(evaluated == (checks_assertions ? 1 : 0));
}

TEST_CASE("assertions of the detector fail where they must") {
  if (!lazyccd::test::finds_failed_beliefs) return;
  CHECK(failed_belief([] {}).empty());
  CHECK(failed_belief([] {
          ThreadPool pool(2);
          auto job = [](int) {};
          pool.submit(job);
          pool.submit(job);
        }) == "one job is submitted at a time");
  const std::vector<VertexRecord> records(3);
  CHECK(failed_belief([&] {
          VerletList list(1, 1);
          list.begin_building(records, 1);
          list.finish_building(0, 0);
          list.begin_building(records, 1);
        }) == "a list is built where there is none");
  CHECK(failed_belief([&] {
          ThreadPool pool(1);
          VerletList list(1, 1);
          list.begin_step(records, 0, Tree(), pool);
        }) == "a list is of the vertices of the step");
}
