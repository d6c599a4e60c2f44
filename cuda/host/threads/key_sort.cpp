#include "host/threads/key_sort.h"

#include <algorithm>
#include <utility>

namespace lazyccd {
namespace {

constexpr int kDigit = 11;  // bits: the ends of 2^11 lists fit in the second-level cache
constexpr std::size_t kBins = std::size_t{1} << kDigit;
constexpr std::size_t kFew = 1 << 10;    // items that a sort by comparison takes
constexpr std::size_t kChunk = 1 << 12;  // fewest items that a thread takes at a time
constexpr std::size_t kLong = 1 << 15;   // items that are worth several threads

// The digits that one radix sort takes, from the most significant bit in which the keys differ.
struct Digits {
  int passes, low;  // number of digits; the lowest bit of the lowest one

  Digits(std::uint64_t differing, std::size_t count) {
    int bits = 0;
    while (bits < 64 && differing >> bits != 0) ++bits;
    // With twice as many bits as the count has, most runs of spread keys are short.
    const int wanted = count > std::size_t{1} << 20 ? 4 : 3;
    passes = std::min(wanted, (bits + kDigit - 1) / kDigit);
    low = std::max(bits - passes * kDigit, 0);
  }
};

std::size_t digit(const KeyedIndex& item, int shift) { return item.key >> shift & (kBins - 1); }

// Equal parts of an array, and how to visit them: on one thread or on several.
class Chunks {
 public:
  Chunks(std::size_t size, std::size_t count, ThreadPool* pool)
      : size_(size), count_(count), length_((size + count - 1) / count), pool_(pool) {}

  std::size_t count() const { return count_; }
  std::size_t begin(std::size_t chunk) const { return std::min(chunk * length_, size_); }
  std::size_t end(std::size_t chunk) const { return begin(chunk + 1); }
  // Calls body(chunk) for all chunks.
  template <class Body>
  void for_each(Body&& body) const {
    if (pool_ == nullptr) {
      for (std::size_t c = 0; c < count_; ++c) body(c);
    } else {
      pool_->parallel_for(count_, 1, [&](std::size_t first, std::size_t last, int) {
        for (std::size_t c = first; c < last; ++c) body(c);
      });
    }
  }

 private:
  std::size_t size_, count_, length_;
  ThreadPool* pool_;
};

std::uint64_t differing_bits(const KeyedIndex* items, const Chunks& chunks,
                             NoinitVector<std::uint32_t>& space) {
  space.resize(std::max(space.size(), 2 * chunks.count()));
  chunks.for_each([&](std::size_t c) {
    std::uint64_t bits = 0;
    for (std::size_t i = chunks.begin(c); i < chunks.end(c); ++i)
      bits |= items[i].key ^ items[0].key;
    space[2 * c] = static_cast<std::uint32_t>(bits);
    space[2 * c + 1] = static_cast<std::uint32_t>(bits >> 32);
  });
  std::uint64_t bits = 0;
  for (std::size_t c = 0; c < chunks.count(); ++c)
    bits |= space[2 * c] | static_cast<std::uint64_t>(space[2 * c + 1]) << 32;
  return bits;
}

// Moves the items to `to`, stably by one digit. So the result does not depend on the chunks.
void sort_by_digit(const KeyedIndex* from, KeyedIndex* to, int shift, const Chunks& chunks,
                   std::uint32_t* counts) {
  chunks.for_each([&](std::size_t c) {
    std::uint32_t* count = counts + c * kBins;
    std::fill_n(count, kBins, 0u);
    for (std::size_t i = chunks.begin(c); i < chunks.end(c); ++i) ++count[digit(from[i], shift)];
  });
  std::uint32_t place = 0;
  for (std::size_t bin = 0; bin < kBins; ++bin)
    for (std::size_t c = 0; c < chunks.count(); ++c)
      place += std::exchange(counts[c * kBins + bin], place);
  chunks.for_each([&](std::size_t c) {
    std::uint32_t* places = counts + c * kBins;
    for (std::size_t i = chunks.begin(c); i < chunks.end(c); ++i)
      to[places[digit(from[i], shift)]++] = from[i];
  });
}

}  // namespace

// The keys are 63 bits wide at most, so every level of the recursion sorts by at least half of the
// bits that are left, and there are few levels.
void KeySort::sort(std::size_t first, std::size_t size, std::size_t chunk_count, ThreadPool* pool,
                   NoinitVector<std::uint32_t>& counts) {
  KeyedIndex* const mine = items.data() + first;
  if (size <= kFew) return std::sort(mine, mine + size);
  const Chunks chunks(size, chunk_count, pool);
  const Digits digits(differing_bits(mine, chunks, counts), size);
  counts.resize(std::max(counts.size(), chunk_count * kBins));
  KeyedIndex *from = mine, *to = other_.data() + first;
  for (int pass = 0; pass < digits.passes; ++pass, std::swap(from, to))
    sort_by_digit(from, to, digits.low + pass * kDigit, chunks, counts.data());
  if (from != mine)
    chunks.for_each([&](std::size_t c) {
      std::copy(from + chunks.begin(c), from + chunks.end(c), mine + chunks.begin(c));
    });
  if (digits.low == 0) return;

  // Runs that agree in all these digits. A chunk has those that begin in it.
  const auto same = [&](std::size_t i, std::size_t j) {
    return (mine[i].key ^ mine[j].key) >> digits.low == 0;
  };
  std::vector<std::size_t> starts{0};
  for (std::size_t c = 1; c < chunk_count; ++c) {
    std::size_t i = std::max(chunks.begin(c), starts.back());
    while (i < size && same(i - 1, i)) ++i;
    starts.push_back(i);
  }
  starts.push_back(size);
  std::vector<std::vector<std::size_t>> long_runs(chunk_count);
  chunks.for_each([&](std::size_t c) {
    for (std::size_t i = starts[c], end; i < starts[c + 1]; i = end) {
      for (end = i + 1; end < starts[c + 1] && same(i, end);) ++end;
      if (end - i > kLong) {
        long_runs[c].insert(long_runs[c].end(), {i, end});
      } else if (end - i > kFew) {
        sort_alone(first + i, first + end);
      } else if (end - i > 1) {
        std::sort(mine + i, mine + end);
      }
    }
  });
  for (const std::vector<std::size_t>& runs : long_runs)
    for (std::size_t i = 0; i < runs.size(); i += 2)
      sort(first + runs[i], runs[i + 1] - runs[i], chunk_count, pool, counts);
}

void KeySort::sort_alone(std::size_t first, std::size_t last) {
  NoinitVector<std::uint32_t> counts;
  sort(first, last - first, 1, nullptr, counts);
}

void KeySort::sort(std::size_t first, std::size_t last, ThreadPool& pool) {
  prepare();
  const std::size_t threads = static_cast<std::size_t>(pool.available());
  const std::size_t chunks = std::min((last - first) / kChunk + 1, 2 * threads);
  const bool alone = threads == 1 || chunks == 1;
  sort(first, last - first, alone ? 1 : chunks, alone ? nullptr : &pool, counts_);
}

}  // namespace lazyccd
