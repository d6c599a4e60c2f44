// The stats of a step.
#pragma once

#include "gpu/step.h"
#include "lazyccd/detector.h"
#include "lazyccd/stats.h"

namespace lazyccd::gpu {

/// Fills in what a completed step counted and how long it took. `counters`: of all its parts.
void fill_stats(Step& step, const StepCounters& counters, const DetectorOptions& options,
                Stats& stats);

}  // namespace lazyccd::gpu
