// Failures on purpose, for tests of what happens when the device fails or its memory is exhausted.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>

namespace lazyccd::gpu {

/// What fails on this thread. By default nothing does.
struct Faults {
  /// The checked CUDA call that fails: 0 the next one, 1 the one after it. Negative: none.
  long call = -1;
  bool lasts = false;  ///< whether all calls after it fail too, as after the loss of a device
  cudaError_t error = cudaErrorUnknown;
  /// Largest size of a buffer in device memory, bytes: a larger one does not fit. 0: no limit.
  std::size_t most_bytes = 0;
};
inline thread_local Faults faults;

/// Counts a checked call. Returns the error that it is to report.
inline cudaError_t injected_error() {
  if (faults.call < 0) return cudaSuccess;
  if (faults.call > 0) {
    --faults.call;
    return cudaSuccess;
  }
  if (!faults.lasts) faults.call = -1;
  return faults.error;
}

}  // namespace lazyccd::gpu
