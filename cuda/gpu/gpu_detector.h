// The CUDA backend of the detector. It reports the same contacts as the CPU backend. This header is
// plain C++.
#pragma once

#include <memory>
#include <string>

#include "cpu/backend.h"
#include "lazyccd/detector.h"

namespace lazyccd {

class ThreadPool;

/// Makes the CUDA backend. Throws Error(unavailable) if there is no CUDA device. `threads` does the
/// host's part of the work and must outlive the detector.
std::unique_ptr<BackendDetector> make_gpu_detector(const DetectorOptions& options,
                                                   ThreadPool& threads);

}  // namespace lazyccd
