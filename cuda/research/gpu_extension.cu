#include "research/gpu_extension.h"

#include "gpu/traversal/extension.h"
#include "research/gpu_culling/device_culling.h"
#include "research/gpu_strategies/strategies.h"

namespace lazyccd::gpu::research {
namespace {

std::unique_ptr<TraversalStrategy> make_strategy(const AlgorithmOptions& options, bool culls) {
  switch (options.strategy) {
    case Strategy::lazy_stealing:
      return culls ? make_culling_lazy_stealing(options.tuning)
                   : make_lazy_stealing(options.tuning);
    case Strategy::lazy_stealing_greedy:
      return make_greedy_stealing(options.tuning, culls);
    case Strategy::static_list:
      return make_static_list(options.tuning, culls);
    case Strategy::task_stealing:
      return make_task_stealing(options.tuning, culls);
    case Strategy::guided:
      return make_guided(options.tuning, culls);
    case Strategy::thread_per_query:
      return make_thread_per_query(options.tuning, culls);
  }
  throw Error(ErrorCode::invalid_argument, "unknown strategy");
}

std::unique_ptr<SceneCulling> make_culling(const DetectorOptions& options) {
  return std::make_unique<DeviceCulling>(options);
}

constexpr Extension extension{make_strategy, make_culling};

}  // namespace

const Extension& gpu_extension() { return extension; }

}  // namespace lazyccd::gpu::research
