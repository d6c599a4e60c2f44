// CUDA streams and events as objects.
#pragma once

#include <cuda_runtime_api.h>

#include "gpu/device/check.h"

namespace lazyccd::gpu {

class Stream {
 public:
  Stream() { LAZYCCD_CUDA_CHECK(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking)); }
  ~Stream() { static_cast<void>(cudaStreamDestroy(stream_)); }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;
  operator cudaStream_t() const { return stream_; }

 private:
  cudaStream_t stream_ = nullptr;
};

class Event {
 public:
  Event() { LAZYCCD_CUDA_CHECK(cudaEventCreate(&event_)); }
  ~Event() { static_cast<void>(cudaEventDestroy(event_)); }
  Event(const Event&) = delete;
  Event& operator=(const Event&) = delete;

  void record(cudaStream_t stream) { LAZYCCD_CUDA_CHECK(cudaEventRecord(event_, stream)); }
  /// Lets later work on `stream` wait for what was recorded.
  void hold(cudaStream_t stream) { LAZYCCD_CUDA_CHECK(cudaStreamWaitEvent(stream, event_, 0)); }
  void wait() { LAZYCCD_CUDA_CHECK(cudaEventSynchronize(event_)); }
  bool has_passed() {
    const cudaError_t result = cudaEventQuery(event_);
    if (result == cudaErrorNotReady) {
      static_cast<void>(cudaGetLastError());
      return false;
    }
    LAZYCCD_CUDA_CHECK(result);
    return true;
  }
  /// Returns the milliseconds from `start` to this event. Both events must have passed.
  double since(const Event& start) const {
    float ms = 0;
    LAZYCCD_CUDA_CHECK(cudaEventElapsedTime(&ms, start.event_, event_));
    return ms;
  }

 private:
  cudaEvent_t event_ = nullptr;
};

}  // namespace lazyccd::gpu
