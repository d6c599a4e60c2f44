#include "solver/block_colours.h"

#include <algorithm>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "support/catch.h"

using lazyccd::bullet::BlockColours;

TEST_CASE("blocks of one colour share no slot, unless it is the overflow") {
  std::mt19937 random(1);
  const std::int32_t slots = GENERATE(2, 100, 5000);
  std::uniform_int_distribution<std::int32_t> any(0, slots - 1);
  BlockColours colours;
  colours.begin();
  colours.grow(static_cast<std::size_t>(slots));
  std::map<int, std::set<std::int32_t>> taken;
  for (int block = 0; block < 300; ++block) {
    std::vector<std::int32_t> moved(10);
    for (std::int32_t& slot : moved) slot = any(random);
    const int colour = colours.add_block(moved, {});
    REQUIRE(colour >= 0);
    REQUIRE(colour < BlockColours::count);
    if (colour == BlockColours::overflow) {
      CHECK(slots < 5000);
      continue;
    }
    const std::set<std::int32_t> unique(moved.begin(), moved.end());
    for (const std::int32_t slot : unique) CHECK(taken[colour].insert(slot).second);
  }
}

TEST_CASE("a colour has at most as many blocks of a shared body as its limit") {
  BlockColours colours;
  colours.begin();
  colours.grow(100);
  const int body = colours.add_body(3), other = colours.add_body(1000);
  std::vector<int> of_body(BlockColours::count, 0);
  for (std::int32_t block = 0; block < 7; ++block)
    ++of_body[colours.add_block({block}, {body, other})];
  CHECK(of_body[0] == 3);
  CHECK(of_body[1] == 3);
  CHECK(of_body[2] == 1);
  // The largest number becomes the limit.
  CHECK(colours.close_body(body) == 3);
  CHECK(colours.close_body(other) == 3);
  for (std::int32_t block = 7; block < 20; ++block) ++of_body[colours.add_block({block}, {other})];
  CHECK(*std::max_element(of_body.begin(), of_body.end()) == 3);
}

TEST_CASE("a body that no block has moved may be moved by one block of a colour") {
  BlockColours colours;
  colours.begin();
  colours.grow(10);
  const int body = colours.add_body(5);
  CHECK(colours.close_body(body) == 1);
  CHECK(colours.add_block({0}, {body}) == 0);
  CHECK(colours.add_block({1}, {body}) == 1);
}
