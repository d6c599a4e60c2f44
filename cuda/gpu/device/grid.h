// Grid sizes for persistent blocks.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>

#include "gpu/device/check.h"

namespace lazyccd::gpu {

/// Returns how many blocks of the kernel the current device can run at the same time.
template <class Kernel>
int resident_blocks(Kernel* kernel, int block_size, std::size_t shared_bytes) {
  int device = 0, multiprocessors = 0, blocks = 0;
  LAZYCCD_CUDA_CHECK(cudaGetDevice(&device));
  LAZYCCD_CUDA_CHECK(
      cudaDeviceGetAttribute(&multiprocessors, cudaDevAttrMultiProcessorCount, device));
  LAZYCCD_CUDA_CHECK(
      cudaOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, kernel, block_size, shared_bytes));
  return multiprocessors * blocks;
}

}  // namespace lazyccd::gpu
