#include "cpu/narrow/contact_sort.h"

#include <algorithm>
#include <array>
#include <atomic>

#include "core/narrow/contact_math.h"

namespace lazyccd {

// Sorts by the least significant digit first. All digits have the same width, and there are as few
// of them as possible.
void ContactSort::radix_sort(int bits) {
  constexpr int max_digit = 12;  // bits
  const int passes = (bits + max_digit - 1) / max_digit;
  if (passes == 0) return;
  const int digit = (bits + passes - 1) / passes;
  const std::uint64_t mask = (std::uint64_t{1} << digit) - 1;
  other_.resize(items_.size());
  for (int shift = 0; shift < bits; shift += digit) {
    std::array<std::uint32_t, (1 << max_digit) + 1> begin;
    std::fill_n(begin.begin(), mask + 2, 0);
    for (const Item& item : items_) ++begin[(item.key >> shift & mask) + 1];
    for (std::size_t i = 1; i <= mask; ++i) begin[i] += begin[i - 1];
    for (const Item& item : items_) other_[begin[item.key >> shift & mask]++] = item;
    items_.swap(other_);
  }
}

std::uint64_t ContactSort::operator()(Span<const ContactPart> parts, ThreadPool& pool,
                                      std::vector<Contact>& out) {
  std::size_t count = 0;
  for (const ContactPart& part : parts) count += part.keys.size();
  items_.resize(count);
  Item* item = items_.data();
  for (const ContactPart& part : parts)
    for (std::size_t i = 0; i < part.keys.size(); ++i) *item++ = {part.keys[i], &part.contacts[i]};
  constexpr std::size_t min_for_radix = 512;  // for fewer, the histograms cost more than they save
  const bool is_small = items_.size() < min_for_radix;
  if (key_.is_one_word() && is_small) {
    std::sort(items_.begin(), items_.end(),
              [](const Item& a, const Item& b) { return a.key < b.key; });
  } else if (key_.is_one_word()) {
    radix_sort(key_.bits());
  } else if (key_.is_two_words() && !is_small) {
    radix_sort(key_.lower_bits());
    for (Item& i : items_) i.key = key_.upper(*i.contact);
    radix_sort(key_.upper_bits());
  } else {
    std::sort(items_.begin(), items_.end(),
              [this](const Item& a, const Item& b) { return order_(*a.contact, *b.contact); });
  }
  out.resize(items_.size());
  std::atomic<std::uint64_t> hash{0};
  pool.parallel_for(items_.size(), 512, [&](std::size_t first, std::size_t last, int) {
    std::uint64_t sum = 0;
    for (std::size_t i = first; i < last; ++i) {
      out[i] = *items_[i].contact;
      sum += hash_share(*items_[i].contact);
    }
    hash.fetch_add(sum, std::memory_order_relaxed);  // Relaxed: read after the end of the job.
  });
  return hash.load(std::memory_order_relaxed);
}

// Merges from the back, so that contacts before the first inserted one stay in place.
void merge(Span<const Contact> more, const ContactOrder& order, std::vector<Contact>& sorted) {
  std::size_t i = sorted.size(), j = more.size();
  sorted.resize(i + j);
  while (j > 0) {
    const bool is_from_more = i == 0 || order(sorted[i - 1], more[j - 1]);
    sorted[i + j - 1] = is_from_more ? more[j - 1] : sorted[i - 1];
    --(is_from_more ? j : i);
  }
}

}  // namespace lazyccd
