// From the host's memory to the device's, at once.
#pragma once

#include <cuda_runtime_api.h>

#include <algorithm>
#include <cstddef>

#include "gpu/device/check.h"
#include "gpu/device/device_buffer.h"

namespace lazyccd::gpu {

template <class T>
void upload(DeviceBuffer<T>& buffer, const void* items, std::size_t count) {
  buffer.reserve(std::max<std::size_t>(count, 1));
  if (count)
    LAZYCCD_CUDA_CHECK(cudaMemcpy(buffer.data(), items, count * sizeof(T), cudaMemcpyHostToDevice));
}

}  // namespace lazyccd::gpu
