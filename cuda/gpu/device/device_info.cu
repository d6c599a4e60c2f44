#include "gpu/device/device_info.h"

#include <cuda_runtime_api.h>

#include "gpu/device/check.h"

namespace lazyccd::gpu {
namespace {

// Writes a version as CUDA numbers it: 12040 is 12.4.
std::string version_text(int version) {
  return std::to_string(version / 1000) + "." + std::to_string(version % 1000 / 10);
}

}  // namespace

void require_device() {
  int devices = 0, driver = 0;
  const cudaError_t result = cudaGetDeviceCount(&devices);
  // Without a driver the version is 0. With an old one, users want to know.
  if (result == cudaErrorInsufficientDriver && cudaDriverGetVersion(&driver) == cudaSuccess &&
      driver > 0)
    throw Error(ErrorCode::device, "the NVIDIA driver is for CUDA " + version_text(driver) +
                                       " and too old for this build, which needs CUDA " +
                                       version_text(CUDART_VERSION));
  if (result != cudaSuccess || devices == 0) {
    static_cast<void>(cudaGetLastError());
    throw Error(ErrorCode::unavailable,
                std::string("no CUDA device is available (") + cudaGetErrorString(result) + ")");
  }
}

int chosen_device(const DetectorOptions& options) {
  int device = options.device, devices = 0;
  LAZYCCD_CUDA_CHECK(cudaGetDeviceCount(&devices));
  if (device < 0) LAZYCCD_CUDA_CHECK(cudaGetDevice(&device));
  if (device >= devices)
    throw Error(ErrorCode::unavailable, "there is no device " + std::to_string(device) + "; " +
                                            std::to_string(devices) + " are visible");
  return device;
}

std::string describe_device(int device) {
  int driver = 0;
  cudaDeviceProp properties;
  LAZYCCD_CUDA_CHECK(cudaGetDeviceProperties(&properties, device));
  LAZYCCD_CUDA_CHECK(cudaDriverGetVersion(&driver));
  return std::string(properties.name) + ", driver for CUDA " + version_text(driver);
}

}  // namespace lazyccd::gpu
