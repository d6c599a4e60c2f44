// What a library beside the core adds to the backends: further strategies, volumes and culling.
// The core has lazy stealing, axis-aligned boxes and the non-penetration filter.
#pragma once

#include "lazyccd/detector.h"
#include "lazyccd/export.h"

namespace lazyccd {

struct CpuExtension;  // cpu/extension.h
namespace gpu {
struct Extension;  // gpu/traversal/extension.h
}

/// Tables of functions, one for each backend. `gpu` is null in a build without CUDA.
struct Extension {
  const CpuExtension* cpu;
  const gpu::Extension* gpu;
};

/// Makes an extension known to all detectors from now on. It must stay valid. Any thread may call
/// it.
LAZYCCD_API void set_extension(const Extension& extension);

/// Returns the extension, if the options ask for what the core does not have; otherwise null.
/// Throws Error(unavailable) that names the option, if no library has added it.
const Extension* find_extension(const AlgorithmOptions& options);

/// Returns the culling that the options ask for and that applies. Some of it rules out pairs that
/// cannot touch; such pairs can still come within a separation.
LAZYCCD_API Culling culling_in_use(const DetectorOptions& options);
/// Whether the options ask for culling of nodes beyond their axis-aligned boxes.
bool culls_nodes(const DetectorOptions& options);
/// Whether the options ask for elementary pairs to be tested apart from the traversal.
bool excludes_pairs(const DetectorOptions& options);

}  // namespace lazyccd
