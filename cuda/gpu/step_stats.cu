#include "gpu/step_stats.h"

namespace lazyccd::gpu {

void fill_stats(Step& step, const StepCounters& c, const DetectorOptions& options, Stats& stats) {
  const TraversalCounters& t = step.traversal().counters();
  stats.groups = step.group_count();
  stats.tree_tests = static_cast<std::int64_t>(t.tree_tests);
  stats.front_nodes = static_cast<std::int64_t>(t.front_nodes);
  stats.idle_share = step.traversal().idle_share();
  stats.steals = static_cast<std::int64_t>(t.steals);
  stats.balancings = static_cast<std::int64_t>(t.balancings);
  stats.overflows += static_cast<std::int64_t>(t.overflows);
  stats.group_pairs = t.leaf_pairs;

  // With a separation the filter is the last stage before the decision.
  const bool has_separation = options.separation > 0;
  const auto sum = [](std::int64_t a, std::int64_t b) { return a + b; };
  stats.candidates_vf = static_cast<std::int64_t>(c.candidates[0]);
  stats.candidates_ee = static_cast<std::int64_t>(c.candidates[1]);
  stats.survivors_vf = has_separation ? c.filtered[0] : sum(c.hits[0], c.undecided_in_single[0]);
  stats.survivors_ee = has_separation ? c.filtered[1] : sum(c.hits[1], c.undecided_in_single[1]);
  // Only this filter lies between the two counts.
  if (options.algorithm.culling.non_penetration)
    stats.filtered_noncoplanar =
        stats.candidates_vf + stats.candidates_ee - sum(c.filtered[0], c.filtered[1]);
  if (step.culling()) step.culling()->add_to(stats);
  stats.double_precision_tests = c.double_precision_tests;
  stats.exact_tests = c.undecided_in_double;
  stats.hash = c.hash;
  stats.near_pairs = sum(c.near[0], c.near[1]);
  stats.contacts_vf = c.contacts_vf;
  stats.contacts_ee = sum(c.contacts, 0) - c.contacts_vf;

  stats.ms_device = step.milliseconds(Step::kStart, Step::kSorted);
  if (options.algorithm.tuning.graph) return;
  stats.ms_refit = step.milliseconds(Step::kStart, Step::kRefitted);
  stats.ms_traverse = step.milliseconds(Step::kRefitted, Step::kTraversed);
  stats.ms_leaf = step.milliseconds(Step::kTraversed, Step::kFiltered);
  stats.ms_narrow = step.milliseconds(Step::kFiltered, Step::kDecided);
  stats.ms_sort = step.milliseconds(Step::kDecided, Step::kSorted);
}

}  // namespace lazyccd::gpu
