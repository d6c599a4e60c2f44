#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <random>
#include <thread>
#include <vector>

#include "balance/chunk_pool.h"
#include "balance/deque.h"
#include "balance/host_atomics.h"
#include "host/threads/spin_wait.h"
#include "support/catch.h"

namespace {

using lazyccd::no_chunk;
using Counts = std::vector<std::atomic<std::uint8_t>>;

// Stalls for a random time, in which other threads may do nothing or several rounds.
void stall() {
  static std::atomic<unsigned> seed{1};
  thread_local std::minstd_rand random(seed.fetch_add(1, std::memory_order_relaxed));
  const auto r = random() % 256;
  for (auto i = r % 16; i > 0; --i) lazyccd::cpu_relax();
  if (r < 16) std::this_thread::yield();
  if (r < 4) std::this_thread::sleep_for(std::chrono::microseconds(1));
}

// Stalls at the critical point: between the reads of an operation and its compare-and-swap.
struct StallingAtomics : lazyccd::HostAtomics {
  template <class T>
  static bool compare_exchange(std::atomic<T>& cell, T& expected, T desired,
                               std::memory_order success, std::memory_order failure) {
    stall();
    return lazyccd::HostAtomics::compare_exchange(cell, expected, desired, success, failure);
  }
};

using Deque = lazyccd::Deque<StallingAtomics>;
using FreeList = lazyccd::FreeList<StallingAtomics>;

bool each_is(const Counts& counts, std::uint8_t value) {
  for (const auto& count : counts)
    if (count != value) return false;
  return true;
}

}  // namespace

TEST_CASE("a chunk is taken exactly once by its owner or one thief and with its content") {
  const std::uint32_t capacity = GENERATE(1u, 2u, 8u);
  const int thieves = GENERATE(1, 3);
  // Few ids, so that each is reused while a slow thief still has its old value.
  const std::uint32_t chunks = capacity + 1;
  constexpr std::uint32_t numbers = 20'000;

  std::atomic<std::uint64_t> word{0}, head{0};
  std::unique_ptr<std::atomic<std::uint32_t>[]> ring(new std::atomic<std::uint32_t>[capacity]());
  std::unique_ptr<std::atomic<std::uint32_t>[]> links(new std::atomic<std::uint32_t>[chunks]());
  std::vector<std::uint32_t> content(chunks);  // not atomic: the protocol orders every access
  FreeList free_list(head, links.get(), chunks);
  Counts taken(numbers);
  std::atomic<std::uint32_t> taken_by_all{0};

  const auto take = [&](std::uint32_t chunk) {
    taken[content[chunk]].fetch_add(1, std::memory_order_relaxed);
    free_list.give(&chunk, 1);
    taken_by_all.fetch_add(1, std::memory_order_relaxed);
  };
  std::vector<std::thread> threads;
  for (int t = 0; t < thieves; ++t) {
    threads.emplace_back([&] {
      Deque deque(word, ring.get(), capacity);
      while (taken_by_all.load(std::memory_order_relaxed) < numbers) {
        const std::uint32_t chunk = deque.steal();
        if (chunk != no_chunk) {
          stall();
          take(chunk);
        } else {
          std::this_thread::yield();
        }
      }
    });
  }
  std::minstd_rand random(99);
  Deque deque(word, ring.get(), capacity);
  for (std::uint32_t number = 0; number < numbers;) {
    std::uint32_t chunk = no_chunk;
    if (random() % 4 != 0 && deque.has_room() && free_list.take(&chunk, 1) == 1) {
      content[chunk] = number++;
      deque.push(chunk);
    } else if ((chunk = deque.pop()) != no_chunk) {
      take(chunk);
    }
    stall();
  }
  for (std::uint32_t chunk; (chunk = deque.pop()) != no_chunk;) take(chunk);
  for (std::thread& thread : threads) thread.join();

  CHECK(each_is(taken, 1));
  CHECK(deque.size() == 0);
  std::vector<std::uint32_t> ids(chunks);
  CHECK(free_list.take(ids.data(), chunks) == chunks);
}

TEST_CASE("a free chunk is held by one worker at a time") {
  constexpr std::uint32_t chunks = 5;
  constexpr int workers = 4;
  std::atomic<std::uint64_t> head{0};
  std::unique_ptr<std::atomic<std::uint32_t>[]> links(new std::atomic<std::uint32_t>[chunks]());
  FreeList free_list(head, links.get(), chunks);
  std::vector<int> holder(chunks, -1);  // not atomic: a second holder would be a data race
  std::atomic<bool> right{true};

  std::vector<std::thread> threads;
  for (int w = 0; w < workers; ++w) {
    threads.emplace_back([&, w] {
      std::minstd_rand random(static_cast<unsigned>(w + 1));
      for (int round = 0; round < 5'000; ++round) {
        std::uint32_t ids[3];
        const std::uint32_t count = free_list.take(ids, 1 + random() % 3);
        for (std::uint32_t i = 0; i < count; ++i) holder[ids[i]] = w;
        stall();
        for (std::uint32_t i = 0; i < count; ++i)
          if (holder[ids[i]] != w) right = false;
        // One by one, the newest first: this order restores the old head, an ABA problem without
        // tags.
        if (random() % 2 == 0) {
          free_list.give(ids, count);
        } else {
          for (std::uint32_t i = 0; i < count; ++i) free_list.give(ids + i, 1);
        }
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  CHECK(right);
  std::vector<std::uint32_t> ids(chunks);
  CHECK(free_list.take(ids.data(), chunks) == chunks);
}
