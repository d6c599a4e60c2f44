// The CUDA backend: what the CPU backend does, on the device. Plain C++ for its users.
#pragma once

#include <memory>
#include <string>

#include "cpu/backend.h"
#include "lazyccd/detector.h"

namespace lazyccd {

class ThreadPool;

// Throws Error(unavailable) where no device answers. The threads, which must outlive it, do what is the
// host's.
std::unique_ptr<BackendDetector> make_gpu_detector(const DetectorOptions& options, ThreadPool& threads);

}  // namespace lazyccd
