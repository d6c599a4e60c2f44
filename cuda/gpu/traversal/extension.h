// What an extension (host/extension.h) adds to the GPU backend.
#pragma once

#include <memory>

#include "gpu/scene/scene_culling.h"
#include "gpu/traversal/traversal_strategy.h"
#include "lazyccd/detector.h"

namespace lazyccd::gpu {

/// Functions that make what the options ask for.
struct Extension {
  /// A strategy that the core does not have, or any strategy with culling of nodes.
  std::unique_ptr<TraversalStrategy> (*make_strategy)(const AlgorithmOptions& options,
                                                      bool culls_nodes);
  /// If culls_nodes(options) or excludes_pairs(options).
  std::unique_ptr<SceneCulling> (*make_culling)(const DetectorOptions& options);
};

}  // namespace lazyccd::gpu
