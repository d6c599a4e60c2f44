#include "cpu/contact_sort.h"

#include <algorithm>
#include <array>

namespace lazyccd {

ContactSort::ContactSort(const Mesh& mesh)
    : key_(ContactKey::of(mesh.body_count(), mesh.vertex_count(), mesh.edges().size(),
                          mesh.faces().size())) {}

// Least significant digit first; digits of equal width, as few as there can be.
void ContactSort::radix_sort() {
  constexpr int widest = 12;
  const int bits = key_.bits(), passes = (bits + widest - 1) / widest;
  if (passes == 0) return;
  const int digit = (bits + passes - 1) / passes;
  const std::uint64_t mask = (std::uint64_t{1} << digit) - 1;
  other_.resize(items_.size());
  for (int shift = 0; shift < bits; shift += digit) {
    std::array<std::uint32_t, (1 << widest) + 1> begin;
    std::fill_n(begin.begin(), mask + 2, 0);
    for (const Item& item : items_) ++begin[(item.key >> shift & mask) + 1];
    for (std::size_t i = 1; i <= mask; ++i) begin[i] += begin[i - 1];
    for (const Item& item : items_) other_[begin[item.key >> shift & mask]++] = item;
    items_.swap(other_);
  }
}

void ContactSort::operator()(const std::vector<const std::vector<Contact>*>& parts,
                             ThreadPool& pool, std::vector<Contact>& out) {
  const bool fits = key_.fits();
  items_.clear();
  for (const std::vector<Contact>* part : parts)
    for (const Contact& c : *part) items_.push_back({fits ? key_(c) : 0, &c});
  constexpr std::size_t few = 512;  // before the counts of a pass pay
  if (fits && items_.size() < few) {
    std::sort(items_.begin(), items_.end(),
              [](const Item& a, const Item& b) { return a.key < b.key; });
  } else if (fits) {
    radix_sort();
  } else {
    std::sort(items_.begin(), items_.end(),
              [](const Item& a, const Item& b) { return *a.contact < *b.contact; });
  }
  out.resize(items_.size());
  pool.parallel_for(items_.size(), 4096, [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i) out[i] = *items_[i].contact;
  });
}

}  // namespace lazyccd
