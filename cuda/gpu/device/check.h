// Conversion of CUDA errors to lazyccd::Error.
#pragma once

#include <cuda_runtime_api.h>

#include <string>

#include "gpu/device/faults.h"
#include "lazyccd/error.h"

namespace lazyccd {

/// Device memory, or page-locked memory of the host, is exhausted. Unlike other errors of the
/// device, it may be avoided by working in smaller parts.
class OutOfDeviceMemory : public Error {
 public:
  explicit OutOfDeviceMemory(const std::string& what) : Error(ErrorCode::device, what) {}
};

inline void check_cuda(cudaError_t result, const char* expression, const char* file, int line) {
  if (result == cudaSuccess) result = gpu::injected_error();
  if (result == cudaSuccess) return;
  // Clears the error; otherwise the runtime would report it again to the next caller.
  static_cast<void>(cudaGetLastError());
  const std::string what = std::string(expression) + " at " + file + ":" + std::to_string(line) +
                           ": " + cudaGetErrorName(result) + " (" + cudaGetErrorString(result) +
                           ")";
  if (result == cudaErrorMemoryAllocation) throw OutOfDeviceMemory(what);
  throw Error(ErrorCode::device, what);
}

}  // namespace lazyccd

/// Throws Error(ErrorCode::device) with the expression, its place in the source and the CUDA error.
/// After a launch: LAZYCCD_CUDA_CHECK(cudaGetLastError()).
#define LAZYCCD_CUDA_CHECK(expression) \
  ::lazyccd::check_cuda((expression), #expression, __FILE__, __LINE__)
