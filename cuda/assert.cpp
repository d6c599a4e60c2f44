#include "lazyccd/debug/assert.h"

#include <atomic>
#include <cstdio>
#include <cstdlib>

namespace lazyccd {
namespace {

std::atomic<AssertHandler> handler_of_assertions{nullptr};

}  // namespace

AssertHandler set_assert_handler(AssertHandler handler) {
  return handler_of_assertions.exchange(handler);
}

void assertion_failed(const FailedAssertion& failed) noexcept {
  const AssertHandler handler = handler_of_assertions.load();
  if (handler && handler(failed)) return;
  std::fprintf(stderr, "%s:%d: LazyCCD: it does not hold that %s: %s\n", failed.file, failed.line,
               failed.belief, failed.condition);
  std::abort();
}

}  // namespace lazyccd
