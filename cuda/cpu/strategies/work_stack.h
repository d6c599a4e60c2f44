// A worker's own items: a stack, last in, first out, that grows as needed.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

namespace lazyccd {

template <class Item>
class WorkStack {
  static_assert(std::is_trivially_copyable_v<Item>);

 public:
  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  std::size_t bytes() const { return items_.capacity() * sizeof(Item); }

  void push(const Item& item) {
    if (size_ == items_.size()) grow(size_ + 1);
    items_[size_++] = item;
  }
  void push(const Item* items, std::size_t count) {
    if (items_.size() - size_ < count) grow(size_ + count);
    std::copy_n(items, count, items_.data() + size_);
    size_ += count;
  }
  Item pop() { return items_[--size_]; }
  const Item& top() const { return items_[size_ - 1]; }
  void clear() { size_ = 0; }

  /// Removes items and writes them to `out`, oldest first.
  void take_all(Item* out) { take_oldest(out, size_); }
  void take_oldest(Item* out, std::size_t count) {
    std::copy_n(items_.data(), count, out);
    std::copy(items_.data() + count, items_.data() + size_, items_.data());
    size_ -= count;
  }

  /// Removes every second one of the oldest 2 * count items and writes these to `out`, oldest
  /// first. In a depth-first traversal the oldest items head the largest subtrees, and items of one
  /// level are next to each other. Taking every second one leaves half of each level; taking a
  /// contiguous range would leave next to nothing.
  void take_every_second(Item* out, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      out[i] = items_[2 * i];
      items_[i] = items_[2 * i + 1];
    }
    const auto rest = items_.begin() + static_cast<std::ptrdiff_t>(2 * count);
    std::copy(rest, items_.begin() + static_cast<std::ptrdiff_t>(size_),
              items_.begin() + static_cast<std::ptrdiff_t>(count));
    size_ -= count;
  }

 private:
  void grow(std::size_t size) {
    items_.resize(std::max({size, 2 * items_.size(), std::size_t{1024}}));
  }

  std::vector<Item> items_;
  std::size_t size_ = 0;
};

}  // namespace lazyccd
