// Choice of the device of a call.
#pragma once

#include <cuda_runtime_api.h>

#include "gpu/device/check.h"

namespace lazyccd::gpu {

/// Makes a device the current one of this thread, until the end of the scope.
class DeviceScope {
 public:
  explicit DeviceScope(int device) : device_(device) {
    LAZYCCD_CUDA_CHECK(cudaGetDevice(&before_));
    if (device_ != before_) LAZYCCD_CUDA_CHECK(cudaSetDevice(device_));
  }
  ~DeviceScope() { leave(); }
  DeviceScope(const DeviceScope&) = delete;
  DeviceScope& operator=(const DeviceScope&) = delete;

  /// Ends the scope early.
  void leave() {
    if (before_ != device_) static_cast<void>(cudaSetDevice(before_));
  }
  /// Begins it again after leave(). Errors are left to the calls that follow.
  void enter() {
    before_ = device_;
    static_cast<void>(cudaGetDevice(&before_));
    if (before_ != device_) static_cast<void>(cudaSetDevice(device_));
  }

 private:
  int device_, before_ = 0;
};

}  // namespace lazyccd::gpu
