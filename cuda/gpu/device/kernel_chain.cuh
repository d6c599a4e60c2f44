// How kernels are launched: kernels in a row, each working on what the one before made. On Hopper
// and newer the blocks of the next are placed while the last blocks of the one before still run
// (programmatic dependent launch), which saves most of the time between two kernels.
#pragma once

#include <cuda_runtime.h>

#include <cstddef>
#include <cstdint>

#include "gpu/device/check.h"

namespace lazyccd::gpu {

// What the kernels before wrote is there from here on. In every kernel of a chain, so that a kernel
// that is done says so of all before it.
__device__ inline void await_kernels_before() {
#if __CUDA_ARCH__ >= 900
  cudaGridDependencySynchronize();
#endif
}

// From here on the blocks of the next kernel may be placed.
__device__ inline void let_next_kernel_in() {
#if __CUDA_ARCH__ >= 900
  cudaTriggerProgrammaticLaunchCompletion();
#endif
}

// First in a kernel of a chain, before it touches global memory. One that has something to do
// without the kernels before calls both on its own.
__device__ inline void begin_kernel() {
  await_kernels_before();
  let_next_kernel_in();
}

constexpr int kWarp = 32;
constexpr unsigned kAllLanes = 0xffffffffu;

__device__ inline unsigned lanes_below(int lane) { return (1u << lane) - 1; }

inline int device_attribute(cudaDeviceAttr attribute) {
  int device = 0, value = 0;
  LAZYCCD_CUDA_CHECK(cudaGetDevice(&device));
  LAZYCCD_CUDA_CHECK(cudaDeviceGetAttribute(&value, attribute, device));
  return value;
}

inline std::uint32_t multiprocessors() {
  return static_cast<std::uint32_t>(device_attribute(cudaDevAttrMultiProcessorCount));
}

// Blocks of `block` threads for so many threads, one at least.
inline std::uint32_t blocks_for(std::size_t threads, std::uint32_t block) {
  const std::size_t blocks = (threads + block - 1) / block;
  return static_cast<std::uint32_t>(blocks == 0 ? 1 : blocks);
}

// Whether the current device overlaps kernels so. Graphs capture it from CUDA 12.3 on.
inline bool kernels_overlap() {
  return CUDART_VERSION >= 12030 && device_attribute(cudaDevAttrComputeCapabilityMajor) >= 9;
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
  config.numAttrs = kernels_overlap() ? 1 : 0;
  LAZYCCD_CUDA_CHECK(cudaLaunchKernelEx(&config, kernel, static_cast<Parameters>(arguments)...));
}

}  // namespace lazyccd::gpu
