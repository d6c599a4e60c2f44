// The CUDA backend: what the CPU backend does, on the device. Plain C++ for its users.
#pragma once

#include <memory>
#include <string>

#include "cpu/backend.h"
#include "lazyccd/detector.h"

namespace lazyccd {

// Throws Error(unavailable) where no device answers.
std::unique_ptr<BackendDetector> make_gpu_detector(const Options& options);

}  // namespace lazyccd
