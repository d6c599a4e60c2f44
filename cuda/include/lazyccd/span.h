// A view of contiguous memory, for C++17 (std::span is C++20).
#pragma once

#include <cstddef>
#include <type_traits>
#include <vector>

namespace lazyccd {

/// Pointer and length of an array that somebody else owns. Valid as long as the array is.
template <class T>
class Span {
 public:
  constexpr Span() = default;
  constexpr Span(T* data, std::size_t size) : data_(data), size_(size) {}
  /// View of a vector of the same element type, const or not.
  template <class U, class Allocator,
            class = std::enable_if_t<std::is_convertible_v<const U (*)[], T (*)[]>>>
  Span(const std::vector<U, Allocator>& v) : data_(v.data()), size_(v.size()) {}
  template <class U, class Allocator,
            class = std::enable_if_t<std::is_convertible_v<U (*)[], T (*)[]>>>
  Span(std::vector<U, Allocator>& v) : data_(v.data()), size_(v.size()) {}

  constexpr T* data() const { return data_; }
  constexpr std::size_t size() const { return size_; }
  constexpr bool empty() const { return size_ == 0; }
  constexpr T& operator[](std::size_t i) const { return data_[i]; }
  constexpr T* begin() const { return data_; }
  constexpr T* end() const { return data_ + size_; }

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace lazyccd
