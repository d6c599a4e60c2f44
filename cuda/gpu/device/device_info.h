// The devices of this machine.
#pragma once

#include <string>

#include "lazyccd/detector.h"

namespace lazyccd::gpu {

/// Throws Error(unavailable) if there is no device, or Error(device) if the driver is too old.
void require_device();
/// Returns the index of the device that the options ask for. Throws Error(unavailable) if there is
/// none with this index.
int chosen_device(const DetectorOptions& options);
/// Returns the device's name and the CUDA version that the driver supports.
std::string describe_device(int device);

}  // namespace lazyccd::gpu
