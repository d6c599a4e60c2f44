// Whether the GPU backend runs on this machine.
#pragma once

#include <cstdio>

#include "lazyccd/detector.h"

namespace lazyccd {

/// What a check program returns that could not run; CTest reports it as skipped.
inline constexpr int kSkipped = 77;

/// True if no detector can use the GPU. Prints why.
inline bool skips_without_cuda() {
  DetectorOptions options;
  options.backend = Backend::cuda;
  const Detector probe(options);
  if (probe.status() == "cuda") return false;
  std::printf("skipped: %s\n", probe.status().c_str());
  return true;
}

}  // namespace lazyccd
