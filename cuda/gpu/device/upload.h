// Synchronous copy from host memory to device memory.
#pragma once

#include <cuda_runtime_api.h>

#include <algorithm>
#include <cstddef>

#include "gpu/device/check.h"
#include "gpu/device/device_buffer.h"

namespace lazyccd::gpu {

/// Copies `count` items to the buffer. The buffer grows if needed and has room for at least one
/// item.
template <class T>
void upload(DeviceBuffer<T>& buffer, const void* items, std::size_t count) {
  buffer.reserve(std::max<std::size_t>(count, 1));
  if (count)
    LAZYCCD_CUDA_CHECK(cudaMemcpy(buffer.data(), items, count * sizeof(T), cudaMemcpyHostToDevice));
}

}  // namespace lazyccd::gpu
