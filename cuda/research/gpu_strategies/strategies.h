// The strategies of the research wing on the device. culls: with culling of nodes.
#pragma once

#include <memory>

#include "gpu/traversal/traversal_strategy.h"
#include "lazyccd/detector.h"

namespace lazyccd::gpu::research {

std::unique_ptr<TraversalStrategy> make_culling_lazy_stealing(const Tuning& tuning);
std::unique_ptr<TraversalStrategy> make_greedy_stealing(const Tuning& tuning, bool culls);
std::unique_ptr<TraversalStrategy> make_static_list(const Tuning& tuning, bool culls);
std::unique_ptr<TraversalStrategy> make_task_stealing(const Tuning& tuning, bool culls);
std::unique_ptr<TraversalStrategy> make_guided(const Tuning& tuning, bool culls);
std::unique_ptr<TraversalStrategy> make_thread_per_query(const Tuning& tuning, bool culls);

}  // namespace lazyccd::gpu::research
