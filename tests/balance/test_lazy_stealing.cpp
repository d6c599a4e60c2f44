// The lazy stealing protocol step by step. One thread plays several workers.

#include <cstdint>
#include <utility>
#include <vector>

#include "cpu/strategies/lazy_stealing.h"
#include "support/catch.h"

namespace {

using Item = std::uint32_t;
using Stack = lazyccd::WorkStack<Item>;
template <std::uint32_t ChunkSize>
using Stealing = lazyccd::LazyStealing<Item, ChunkSize>;

std::vector<Item> drain(Stack& stack) {
  std::vector<Item> items;
  while (!stack.empty()) items.push_back(stack.pop());
  return items;
}

}  // namespace

TEST_CASE("no work is shared before a worker is idle and then only one chunk for each") {
  Stealing<4> stealing(3);
  const std::vector<Item> initial{0, 1, 2, 3};
  stealing.start(initial.data(), initial.size());
  Stack stack;
  stealing.arrive(0);
  REQUIRE(stealing.take(0, stack));
  CHECK_FALSE(stealing.should_share(0, stack));
  stealing.arrive(1);
  CHECK(stealing.should_share(0, stack));
  REQUIRE(stealing.share(0, stack));
  CHECK_FALSE(stealing.should_share(0, stack));
  stealing.arrive(2);
  CHECK(stealing.should_share(0, stack));
}

TEST_CASE("every second item of the oldest is shared up to the size of a chunk") {
  Stealing<4> stealing(2);
  std::vector<Item> initial{0, 1, 2, 3};
  stealing.start(initial.data(), initial.size());
  Stack mine, theirs;
  stealing.arrive(0);
  stealing.arrive(1);
  REQUIRE(stealing.take(0, mine));
  for (Item item = 4; item < 11; ++item) mine.push(item);
  REQUIRE(stealing.share(0, mine));  // at most four, the size of a chunk
  REQUIRE(stealing.take(1, theirs));
  CHECK(drain(theirs) == std::vector<Item>{6, 4, 2, 0});
  CHECK(drain(mine) == std::vector<Item>{10, 9, 8, 7, 5, 3, 1});
}

TEST_CASE("items without room in the deque stay with their worker and are counted") {
  // Room for one chunk in the ring, or one chunk in all.
  const auto [ring, chunks] = GENERATE(std::pair{1u, 0u}, std::pair{0u, 1u});
  Stealing<1> stealing(3, ring, chunks);
  const Item initial = 0;
  stealing.start(&initial, 1);
  Stack stack;
  for (int worker : {0, 1, 2}) stealing.arrive(worker);
  REQUIRE(stealing.take(0, stack));
  for (Item item = 1; item < 4; ++item) stack.push(item);
  REQUIRE(stealing.share(0, stack));
  CHECK(stack.size() == 3);
  REQUIRE(stealing.should_share(0, stack));
  REQUIRE(stealing.share(0, stack));
  CHECK(stack.size() == 3);
  stealing.leave(0);
  CHECK(stealing.counts(0).overflows == 1);
}

TEST_CASE("a worker's last item is not shared") {
  Stealing<4> stealing(2);
  const Item initial = 0;
  stealing.start(&initial, 1);
  Stack stack;
  stealing.arrive(0);
  stealing.arrive(1);
  REQUIRE(stealing.take(0, stack));
  REQUIRE(stealing.share(0, stack));
  CHECK(stack.size() == 1);
}

TEST_CASE("the run is over for a late worker if the others have done everything") {
  Stealing<4> stealing(2);
  const Item initial = 0;
  stealing.start(&initial, 1);
  Stack stack;
  stealing.arrive(0);
  REQUIRE(stealing.take(0, stack));
  stack.clear();
  CHECK_FALSE(stealing.take(0, stack));
  stealing.arrive(1);
  CHECK_FALSE(stealing.take(1, stack));
}

TEST_CASE("a cancelled run drops its work and the next one starts afresh") {
  Stealing<1> stealing(2, 1u, 1u);
  const std::vector<Item> initial{0, 1};
  stealing.start(initial.data(), initial.size());
  Stack mine, theirs;
  stealing.arrive(0);
  stealing.arrive(1);
  REQUIRE(stealing.take(0, mine));
  mine.push(2);
  REQUIRE(stealing.share(0, mine));  // the only chunk; it stays in the deque
  stealing.cancel(0);
  CHECK_FALSE(stealing.share(1, theirs));

  stealing.start(initial.data(), 1);
  stealing.arrive(0);
  stealing.arrive(1);
  mine.clear();
  REQUIRE(stealing.take(0, mine));
  CHECK(drain(mine) == std::vector<Item>{0});
  mine.push(1);
  mine.push(2);
  REQUIRE(stealing.share(0, mine));
  REQUIRE(stealing.take(1, theirs));
  CHECK(drain(theirs) == std::vector<Item>{1});
  CHECK(stealing.should_share(0, mine) == false);
  CHECK(stealing.counts(0).overflows == 0);
}
