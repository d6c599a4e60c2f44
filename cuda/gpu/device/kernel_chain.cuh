// Launch of kernels in a chain, in which each works on the output of the one before. On Hopper and
// newer devices, blocks of the next kernel are placed while the last blocks of the one before still
// run (programmatic dependent launch). This saves most of the time between two kernels.
#pragma once

#include <cuda_runtime.h>

#include <cstddef>
#include <cstdint>

#include "gpu/device/check.h"

// CUDA 11 does not have it.
#if __CUDA_ARCH__ >= 900 && CUDART_VERSION >= 12000
#define LAZYCCD_DEPENDENT_LAUNCH
#endif

namespace lazyccd::gpu {

/// Waits until the results of all earlier kernels are visible. Every kernel of a chain calls it, so
/// that the end of a kernel also means the end of all kernels before it.
__device__ inline void await_kernels_before() {
#if defined(LAZYCCD_DEPENDENT_LAUNCH)
  cudaGridDependencySynchronize();
#endif
}

/// Allows the device to place blocks of the next kernel from here on.
__device__ inline void let_next_kernel_in() {
#if defined(LAZYCCD_DEPENDENT_LAUNCH)
  cudaTriggerProgrammaticLaunchCompletion();
#endif
}

/// Begins a kernel of a chain, before it touches global memory. A kernel that can start without the
/// results of earlier kernels calls the two functions itself.
__device__ inline void begin_kernel() {
  await_kernels_before();
  let_next_kernel_in();
}

constexpr int kWarp = 32;
constexpr unsigned kAllLanes = 0xffffffffu;

__device__ inline unsigned lanes_below(int lane) { return (1u << lane) - 1; }

/// Returns an attribute of the current device.
inline int device_attribute(cudaDeviceAttr attribute) {
  int device = 0, value = 0;
  LAZYCCD_CUDA_CHECK(cudaGetDevice(&device));
  LAZYCCD_CUDA_CHECK(cudaDeviceGetAttribute(&value, attribute, device));
  return value;
}

inline std::uint32_t multiprocessors() {
  return static_cast<std::uint32_t>(device_attribute(cudaDevAttrMultiProcessorCount));
}

/// Returns the number of blocks of `block` threads that hold `threads` threads, at least one.
inline std::uint32_t blocks_for(std::size_t threads, std::uint32_t block) {
  const std::size_t blocks = (threads + block - 1) / block;
  return static_cast<std::uint32_t>(blocks == 0 ? 1 : blocks);
}

/// Returns whether the current device can overlap kernels in this way. Graphs capture it from CUDA
/// 12.3 on.
inline bool kernels_overlap() {
  return CUDART_VERSION >= 12030 && device_attribute(cudaDevAttrComputeCapabilityMajor) >= 9;
}

/// Launches a kernel behind another kernel of the stream. After a memset or a copy, use <<<>>>
/// instead.
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
