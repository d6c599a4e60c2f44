// An array in device memory that only grows.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <type_traits>
#include <utility>

#include "gpu/device/check.h"

namespace lazyccd {

/// Owns its memory, which belongs to the device that is current when it grows. New memory is
/// uninitialized.
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
  std::size_t size() const { return size_; }  // its capacity, in elements
  std::size_t bytes() const { return size_ * sizeof(T); }
  void free() { release(); }

  /// Ensures room for at least `count` elements. The contents are lost if the buffer grows, also if
  /// that fails. Freeing waits for the device, so running kernels never lose their memory. Throws
  /// OutOfDeviceMemory.
  void reserve(std::size_t count) {
    if (count <= size_) return;
    release();  // first, so that old and new need not fit in memory together
    LAZYCCD_CUDA_CHECK(allocate(count * sizeof(T)));
    size_ = count;
  }

 private:
  cudaError_t allocate(std::size_t bytes) {
    const std::size_t most = gpu::faults.most_bytes;
    if (most != 0 && bytes > most) return cudaErrorMemoryAllocation;
    return cudaMalloc(reinterpret_cast<void**>(&data_), bytes);
  }

  void release() {
    if (data_ != nullptr) static_cast<void>(cudaFree(data_));  // an error cannot be handled
    data_ = nullptr;
    size_ = 0;
  }

  T* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace lazyccd
