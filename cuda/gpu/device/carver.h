// Division of one block of memory into arrays.
#pragma once

#include <cstddef>

namespace lazyccd::gpu {

/// Hands out consecutive arrays, each at a multiple of 256 bytes. With a null block it only counts.
class Carver {
 public:
  explicit Carver(char* block) : block_(block) {}
  /// An array of `count` items; of one, if the count is 0.
  template <class T>
  T* take(std::size_t count) {
    constexpr std::size_t unit = 256;
    const std::size_t first = used_;
    used_ += ((count == 0 ? 1 : count) * sizeof(T) + unit - 1) / unit * unit;
    return block_ == nullptr ? nullptr : reinterpret_cast<T*>(block_ + first);
  }
  std::size_t used() const { return used_; }  ///< bytes

 private:
  char* block_;
  std::size_t used_ = 0;
};

}  // namespace lazyccd::gpu
