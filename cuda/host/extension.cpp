#include "host/extension.h"

#include <atomic>
#include <string>

#include "lazyccd/error.h"

namespace lazyccd {
namespace {

std::atomic<const Extension*> known_extension{nullptr};

// Returns the name of the first option that the core does not have; empty if it has all.
std::string missing_in_core(const AlgorithmOptions& options) {
  if (options.strategy != Strategy::lazy_stealing)
    return std::string("strategy ") + name(options.strategy);
  if (options.volume != Volume::box) return std::string("volume ") + name(options.volume);
  if (options.culling.normal_cones) return "culling normal_cones";
  if (options.culling.orphan_sets) return "culling orphan_sets";
  return "";
}

}  // namespace

// Release: pairs with the acquire in find_extension().
void set_extension(const Extension& extension) {
  known_extension.store(&extension, std::memory_order_release);
}

const Extension* find_extension(const AlgorithmOptions& options) {
  const std::string missing = missing_in_core(options);
  if (missing.empty()) return nullptr;
  const Extension* const extension = known_extension.load(std::memory_order_acquire);
  if (extension == nullptr)
    throw Error(ErrorCode::unavailable, missing +
                                            " is not linked: link LazyCCD::research and call "
                                            "lazyccd::register_research() first");
  return extension;
}

Culling culling_in_use(const DetectorOptions& options) {
  Culling culling = options.algorithm.culling;
  if (options.separation > 0) culling.normal_cones = culling.orphan_sets = false;
  return culling;
}

bool culls_nodes(const DetectorOptions& options) {
  return options.algorithm.volume != Volume::box || culling_in_use(options).normal_cones;
}

bool excludes_pairs(const DetectorOptions& options) { return culling_in_use(options).orphan_sets; }

}  // namespace lazyccd
