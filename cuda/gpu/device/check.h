// Conversion of CUDA errors to lazyccd::Error.
#pragma once

#include <cuda_runtime_api.h>

#include <string>

#include "lazyccd/error.h"

namespace lazyccd {

inline void check_cuda(cudaError_t result, const char* expression, const char* file, int line) {
  if (result == cudaSuccess) return;
  // Clears the error; otherwise the runtime would report it again to the next caller.
  static_cast<void>(cudaGetLastError());
  throw Error(ErrorCode::device, std::string(expression) + " at " + file + ":" +
                                     std::to_string(line) + ": " + cudaGetErrorName(result) + " (" +
                                     cudaGetErrorString(result) + ")");
}

}  // namespace lazyccd

/// Throws Error(ErrorCode::device) with the expression, its place in the source and the CUDA error.
/// After a launch: LAZYCCD_CUDA_CHECK(cudaGetLastError()).
#define LAZYCCD_CUDA_CHECK(expression) \
  ::lazyccd::check_cuda((expression), #expression, __FILE__, __LINE__)
