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
