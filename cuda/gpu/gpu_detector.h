// The CUDA backend of the detector. It reports the same contacts as the CPU backend. This header is
// plain C++.
#pragma once

#include <memory>

#include "host/backend.h"
#include "lazyccd/detector.h"

namespace lazyccd {

class ThreadPool;

/// Makes the CUDA backend on DetectorOptions::device. Throws Error(unavailable) if there is no such
/// device. `threads` does the host's part of the work and must outlive the detector.
std::unique_ptr<DeviceBackend> make_gpu_detector(const DetectorOptions& options,
                                                 ThreadPool& threads);

}  // namespace lazyccd
