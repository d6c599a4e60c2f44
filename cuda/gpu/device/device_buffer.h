// Device memory that only grows.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <type_traits>
#include <utility>

#include "gpu/device/check.h"

namespace lazyccd {

// Belongs to the device that is current when it grows, and starts uninitialized.
template <class T>
class DeviceBuffer {
  static_assert(std::is_trivially_copyable<T>::value, "copied by memcpy");

 public:
  DeviceBuffer() = default;
  explicit DeviceBuffer(std::size_t count) { reserve(count); }
  ~DeviceBuffer() { release(); }
  DeviceBuffer(DeviceBuffer&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}
  DeviceBuffer& operator=(DeviceBuffer&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
  }

  T* data() { return data_; }
  const T* data() const { return data_; }
  std::size_t size() const { return size_; }  // its capacity: elements that there is room for
  std::size_t bytes() const { return size_ * sizeof(T); }

  // Room for `count` elements at least. Contents are lost where it grows, also where that fails.
  // Freeing waits for the device, so nothing that still runs loses its memory.
  void reserve(std::size_t count) {
    if (count <= size_) return;
    release();  // first: old and new need not lie in memory side by side
    LAZYCCD_CUDA_CHECK(cudaMalloc(reinterpret_cast<void**>(&data_), count * sizeof(T)));
    size_ = count;
  }

 private:
  void release() {
    if (data_ != nullptr) static_cast<void>(cudaFree(data_));  // nobody to tell, and nothing to do
    data_ = nullptr;
    size_ = 0;
  }

  T* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace lazyccd
