// Work for tests of load balancing: ranges of numbers that split in unbalanced ways, with random
// stalls. It shows whether each number was visited exactly once.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <memory>
#include <thread>
#include <vector>

#include "cpu/strategies/balanced_run.h"
#include "host/threads/spin_wait.h"

namespace lazyccd::test {

inline std::uint32_t hash(std::uint32_t x) {
  x = (x ^ (x >> 16)) * 0x7feb352du;
  x = (x ^ (x >> 15)) * 0x846ca68bu;
  return x ^ (x >> 16);
}

/// How a range [a, b) is split. Its worker visits a and emits the rest in pieces.
enum class Shape { random, chain, flat };

template <class Emit>
void split(Shape shape, NodePair range, Emit& emit) {
  const std::uint32_t begin = range.a + 1, end = range.b;
  if (begin == end) return;
  const std::uint32_t size = end - begin;
  std::uint32_t cut = begin;
  switch (shape) {
    case Shape::random:
      cut += hash(begin ^ size) % size;
      break;
    case Shape::chain:  // one long path with a leaf at each step: the worst case for sharing
      cut += size > 1 ? 1 : 0;
      break;
    case Shape::flat:  // two halves
      cut += size / 2;
      break;
  }
  if (cut > begin) emit(NodePair{begin, cut});
  emit(NodePair{cut, end});
}

class Visits {
 public:
  explicit Visits(std::uint32_t count)
      : counts_(new std::atomic<std::uint8_t>[count]()), count_(count) {}
  void visit(std::uint32_t i) { counts_[i].fetch_add(1, std::memory_order_relaxed); }
  bool each_once() const {
    return std::all_of(counts_.get(), counts_.get() + count_, [](const auto& c) { return c == 1; });
  }

 private:
  std::unique_ptr<std::atomic<std::uint8_t>[]> counts_;
  std::uint32_t count_;
};

inline void maybe_stall(std::uint32_t number) {
  const std::uint32_t r = hash(number * 2654435761u) % 256;
  if (r == 0) std::this_thread::yield();
  if (r < 16)
    for (std::uint32_t i = 0; i < 10 * r; ++i) lazyccd::cpu_relax();
}

template <class Run>
RunCounts visit_all(Run& run, Shape shape, const std::vector<NodePair>& initial, Visits& visits) {
  return run.run(initial.data(), initial.size(), [&](int, NodePair range, auto& emit) {
    visits.visit(range.a);
    maybe_stall(range.a);
    split(shape, range, emit);
  });
}

/// Splits [0, count) into `pieces` ranges.
inline std::vector<NodePair> pieces_of(std::uint32_t count, std::uint32_t pieces) {
  std::vector<NodePair> ranges;
  for (std::uint32_t i = 0; i < pieces; ++i)
    ranges.push_back({i * count / pieces, (i + 1) * count / pieces});
  return ranges;
}

}  // namespace lazyccd::test
