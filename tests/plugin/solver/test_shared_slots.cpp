#include "solver/shared_slots.h"

#include <algorithm>
#include <map>
#include <random>
#include <vector>

#include "support/catch.h"

using lazyccd::bullet::RowBlock;
using lazyccd::bullet::SharedSlots;
using Indices = std::vector<std::int32_t>;

TEST_CASE(
    "shared slots have the copies of all blocks that share them, in the order of the blocks") {
  std::mt19937 random(1);
  const std::int32_t slot_count = GENERATE(3, 51, 5001);
  std::uniform_int_distribution<std::int32_t> any(0, slot_count / 3 - 1);
  SharedSlots shared;
  Indices scratch(static_cast<std::size_t>(slot_count), 0);
  for (int repetition = 0; repetition < 3; ++repetition) {
    std::vector<RowBlock> blocks(20);
    std::map<std::int32_t, Indices> expected;  // copies by slot
    std::map<std::int32_t, std::size_t> island_of;
    std::int32_t next = slot_count;
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      RowBlock& block = blocks[b];
      block.island = b / 7;
      block.first_own = next;
      // An island has slots of its own.
      const auto island = static_cast<std::int32_t>(block.island);
      for (int i = 0; i < 100; ++i) block.shared.push_back(3 * any(random) + island);
      std::sort(block.shared.begin(), block.shared.end());
      block.shared.erase(std::unique(block.shared.begin(), block.shared.end()), block.shared.end());
      for (std::size_t i = 0; i < block.shared.size(); ++i) {
        expected[block.shared[i]].push_back(block.copy(i));
        island_of[block.shared[i]] = block.island;
      }
      next += static_cast<std::int32_t>(block.own_count());
    }
    shared.build(blocks, scratch);
    CHECK(std::all_of(scratch.begin(), scratch.end(), [](std::int32_t x) { return x == 0; }));
    std::size_t at = 0;
    for (const SharedSlots::Grain& grain : shared.grains()) {
      REQUIRE(grain.first == at);
      for (; at < grain.last; ++at) {
        const auto found = expected.find(shared.slot(at));
        REQUIRE(found != expected.end());
        CHECK(Indices(shared.copies(at).begin(), shared.copies(at).end()) == found->second);
        CHECK(island_of[shared.slot(at)] == grain.island);
        expected.erase(found);
      }
    }
    CHECK(expected.empty());
  }
}

TEST_CASE("blocks that share nothing have no shared slots") {
  SharedSlots shared;
  Indices scratch(10, 0);
  shared.build(std::vector<RowBlock>(3), scratch);
  CHECK(shared.grains().empty());
}
