// Kernels in a row, each working on what the one before made. On Hopper and newer the blocks of the next
// are placed while the last blocks of the one before still run (programmatic dependent launch), which
// saves most of the time between two kernels.
#pragma once

#include <cuda_runtime.h>

#include <cstddef>
#include <cstdint>

#include "gpu/check.h"

namespace lazyccd::gpu {

// First in every kernel of a chain, before it touches global memory.
__device__ inline void begin_kernel() {
#if __CUDA_ARCH__ >= 900
  cudaGridDependencySynchronize();
  cudaTriggerProgrammaticLaunchCompletion();
#endif
}

// Whether the current device knows them. Graphs capture them from CUDA 12.3 on.
inline bool chains_overlap() {
  int device = 0, major = 0;
  LAZYCCD_CUDA_CHECK(cudaGetDevice(&device));
  LAZYCCD_CUDA_CHECK(cudaDeviceGetAttribute(&major, cudaDevAttrComputeCapabilityMajor, device));
  return CUDART_VERSION >= 12030 && major >= 9;
}

// Only behind another kernel: a memset or a copy before it needs <<<>>>.
template <class... Parameters, class... Arguments>
void launch_behind(void (*kernel)(Parameters...), std::uint32_t blocks, std::uint32_t threads,
                   std::size_t shared_bytes, cudaStream_t stream, const Arguments&... arguments) {
  cudaLaunchConfig_t config{};
  config.gridDim = blocks;
  config.blockDim = threads;
  config.dynamicSmemBytes = shared_bytes;
  config.stream = stream;
  cudaLaunchAttribute overlap{};
  overlap.id = cudaLaunchAttributeProgrammaticStreamSerialization;
  overlap.val.programmaticStreamSerializationAllowed = 1;
  config.attrs = &overlap;
  config.numAttrs = chains_overlap() ? 1 : 0;
  LAZYCCD_CUDA_CHECK(cudaLaunchKernelEx(&config, kernel, static_cast<Parameters>(arguments)...));
}

}  // namespace lazyccd::gpu
