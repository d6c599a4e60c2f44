#include <cstdint>
#include <memory>
#include <set>
#include <vector>

#include "balance/chunk_pool.h"
#include "balance/deque.h"
#include "balance/host_atomics.h"
#include "support/catch.h"

namespace {

using lazyccd::ChunkCache;
using lazyccd::HostAtomics;
using lazyccd::no_chunk;

// A deque in zeroed memory.
struct Deque {
  explicit Deque(std::uint32_t capacity)
      : ring(new std::atomic<std::uint32_t>[capacity]()), view(word, ring.get(), capacity) {}
  std::atomic<std::uint64_t> word{0};
  std::unique_ptr<std::atomic<std::uint32_t>[]> ring;
  lazyccd::Deque<HostAtomics> view;
};

struct FreeList {
  explicit FreeList(std::uint32_t capacity)
      : links(new std::atomic<std::uint32_t>[capacity]()), view(head, links.get(), capacity) {}
  std::atomic<std::uint64_t> head{0};
  std::unique_ptr<std::atomic<std::uint32_t>[]> links;
  lazyccd::FreeList<HostAtomics> view;
};

}  // namespace

TEST_CASE("zeroed memory is an empty deque") {
  Deque deque(4);
  CHECK(deque.view.size() == 0);
  CHECK(deque.view.has_room());
  CHECK(deque.view.pop() == no_chunk);
  CHECK(deque.view.steal() == no_chunk);
}

TEST_CASE("an owner pops the newest chunk and a thief steals the oldest") {
  Deque deque(4);
  for (std::uint32_t chunk : {10u, 11u, 12u, 13u}) deque.view.push(chunk);
  CHECK(deque.view.steal() == 10);
  CHECK(deque.view.pop() == 13);
  CHECK(deque.view.steal() == 11);
  CHECK(deque.view.pop() == 12);
  CHECK(deque.view.pop() == no_chunk);
}

TEST_CASE("a ring is full at its capacity and has room after a steal and after a pop") {
  // With 1 every push uses a slot that was just freed. The largest is 2^15, half the range of a
  // 16-bit counter.
  const std::uint32_t capacity =
      GENERATE(1u, 2u, 8u, std::uint32_t{lazyccd::Deque<HostAtomics>::max_capacity});
  Deque deque(capacity);
  for (std::uint32_t i = 0; i < capacity; ++i) {
    REQUIRE(deque.view.has_room());
    deque.view.push(i);
  }
  CHECK(deque.view.size() == capacity);
  CHECK_FALSE(deque.view.has_room());
  CHECK(deque.view.steal() == 0);
  REQUIRE(deque.view.has_room());
  deque.view.push(capacity);
  CHECK_FALSE(deque.view.has_room());
  CHECK(deque.view.pop() == capacity);
  CHECK(deque.view.has_room());
}

TEST_CASE("the counters of a deque wrap without losing a chunk") {
  Deque deque(4);
  deque.view.push(0);
  for (std::uint32_t i = 1; i < 200'000; ++i) {  // the 16-bit counters wrap three times
    deque.view.push(i);
    REQUIRE(deque.view.steal() == i - 1);
  }
  CHECK(deque.view.pop() == 199'999);
  CHECK(deque.view.size() == 0);
}

TEST_CASE("a deque that shrank and grew back has another word") {
  Deque deque(2);
  deque.view.push(7);
  const std::uint64_t before = deque.word;
  CHECK(deque.view.pop() == 7);
  deque.view.push(8);
  CHECK(deque.word != before);
}

TEST_CASE("zeroed memory is a list of all chunks and each is taken once") {
  const std::uint32_t capacity = GENERATE(1u, 2u, 7u);
  FreeList list(capacity);
  std::vector<std::uint32_t> ids(capacity + 1, no_chunk);
  REQUIRE(list.view.take(ids.data(), capacity + 1) == capacity);
  ids.resize(capacity);
  CHECK(std::set<std::uint32_t>(ids.begin(), ids.end()).size() == capacity);
  std::uint32_t none;
  CHECK(list.view.take(&none, 1) == 0);

  list.view.give(ids.data(), capacity);
  std::vector<std::uint32_t> again(capacity);
  CHECK(list.view.take(again.data(), capacity) == capacity);
  CHECK(again == ids);
}

TEST_CASE("a private cache returns chunks beyond its size at once and all others on flush") {
  FreeList list(10);
  ChunkCache<4> cache;
  cache.clear();
  std::vector<std::uint32_t> held;
  for (std::uint32_t id; (id = cache.take(list.view)) != no_chunk;) held.push_back(id);
  CHECK(held.size() == 10);
  for (std::uint32_t id : held) cache.give(list.view, id);
  cache.flush(list.view);
  std::uint32_t ids[10];
  CHECK(list.view.take(ids, 10) == 10);
  CHECK(std::set<std::uint32_t>(ids, ids + 10).size() == 10);
}
