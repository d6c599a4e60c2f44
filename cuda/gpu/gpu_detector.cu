#include "gpu/gpu_detector.h"

#include "gpu/device/device_info.h"
#include "gpu/device_detector.h"

namespace lazyccd {

std::unique_ptr<DeviceBackend> make_gpu_detector(const DetectorOptions& options,
                                                 ThreadPool& threads) {
  gpu::require_device();
  return std::make_unique<gpu::DeviceDetector>(options, threads);
}

}  // namespace lazyccd
