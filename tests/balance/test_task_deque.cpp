#include <array>
#include <atomic>
#include <cstdint>
#include <vector>

#include "balance/host_atomics.h"
#include "balance/portions.h"
#include "research/protocols/static_list.h"
#include "research/protocols/task_deque.h"
#include "support/catch.h"

namespace {

using namespace lazyccd;
using namespace lazyccd::research;

// A deque for eight tasks in zeroed memory.
struct Tasks {
  std::atomic<std::uint64_t> age{0};
  std::atomic<std::uint32_t> bottom{0};
  std::array<std::atomic<std::uint64_t>, 8> slots{};
  TaskDeque<HostAtomics> view{age, bottom, slots.data(), 8};

  void push(std::vector<std::uint64_t> tasks) {
    for (std::size_t i = 0; i < tasks.size(); ++i) view.next()[i] = tasks[i];
    view.push(static_cast<std::uint32_t>(tasks.size()));
  }
  std::vector<std::uint64_t> pop(std::uint32_t most) {
    std::atomic<std::uint64_t>* first = nullptr;
    const std::uint32_t count = view.pop(most, first);
    return {first, first + count};
  }
};

using List = std::vector<std::uint64_t>;

}  // namespace

TEST_CASE("an owner pops several of the newest tasks at once and a thief takes the oldest") {
  Tasks tasks;
  CHECK(tasks.pop(3).empty());
  tasks.push({1, 2, 3, 4, 5});
  CHECK(tasks.view.room() == 3);
  CHECK(tasks.pop(2) == List{4, 5});
  std::uint64_t task = 0;
  REQUIRE(tasks.view.steal(task));
  CHECK(task == 1);
  tasks.push({6});
  CHECK(tasks.pop(8) == List{2, 3, 6});
  CHECK_FALSE(tasks.view.steal(task));
  CHECK(tasks.pop(8).empty());
}

TEST_CASE("an emptied task deque starts again at its first slot") {
  Tasks tasks;
  std::uint64_t task = 0;
  for (std::uint64_t round = 0; round < 100; ++round) {
    tasks.push({1, 2, 3, 4, 5, 6, 7, 8});
    CHECK(tasks.view.room() == 0);
    for (std::uint64_t i = 1; i <= round % 9; ++i) {
      REQUIRE(tasks.view.steal(task));
      REQUIRE(task == i);
    }
    REQUIRE(tasks.pop(8).size() == 8 - round % 9);
    REQUIRE(tasks.view.room() == 8);
  }
}

TEST_CASE("claims cover the items once and then leave the counter alone") {
  std::atomic<std::uint64_t> claimed{0};
  Claims one, other;
  one.start(10);
  other.start(10);
  CHECK(one.next<HostAtomics>(claimed, 4).count == 4);
  CHECK(other.next<HostAtomics>(claimed, 4).first == 4);
  CHECK(one.next<HostAtomics>(claimed, 4).count == 2);
  CHECK(other.next<HostAtomics>(claimed, 4).count == 0);
  const std::uint64_t end = claimed;
  CHECK(other.next<HostAtomics>(claimed, 4).count == 0);
  CHECK(claimed == end);
}

TEST_CASE("even parts are adjacent and their sizes differ by at most one") {
  for (const std::uint64_t total : {0u, 1u, 5u, 12u, 13u}) {
    std::uint64_t next = 0;
    for (std::uint32_t worker = 0; worker < 4; ++worker) {
      const EvenPart part = even_part(total, worker, 4);
      CHECK(part.first == next);
      CHECK(part.count - total / 4 <= 1);
      next += part.count;
    }
    CHECK(next == total);
  }
}
