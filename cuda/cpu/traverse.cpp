// The traversal stage of the CPU backend: from the root, or a front, to pairs of groups.
#include <algorithm>

#include "core/profile.h"
#include "cpu/cpu_detector.h"
#include "cpu/detector_worker.h"
#include "cpu/pair_visitor.h"
#include "lazyccd/debug/stopwatch.h"

namespace lazyccd {

void CpuDetector::traverse(Stats& stats) {
  LAZYCCD_NVTX_RANGE("traverse");
  if (excluded_) {
    for (const auto& worker : workers_) worker->exclude(excluded_.get());
  }
  if (hierarchy_.tree().nodes().empty()) return;
  const NodePair root{0, 0};
  stats.front_reused =
      options_.algorithm.front == FrontUse::on && traversal_->has_front() && front_policy_.reuse();
  if (stats.front_reused) {
    traverse_from(front_, stats);
  } else {
    traverse_from({&root, 1}, stats);
  }
  test_pending(list_state_ == ListState::in_use);
  if (excluded_) test_excluded(stats);
}

void CpuDetector::traverse_from(Span<const NodePair> initial, Stats& stats) {
  const bool has_front = traversal_->has_front();
  const bool keeps_front = options_.algorithm.front == FrontUse::on && has_front && !is_rechecking_;
  if (has_front) stats.front_start = static_cast<std::int64_t>(initial.size());
  Stopwatch watch;
  const RunCounts counts = traversal_->run(initial, PairVisitor(*this, keeps_front));
  stats.tree_tests += static_cast<std::int64_t>(counts.items);
  stats.steals += static_cast<std::int64_t>(counts.steals);
  stats.overflows += static_cast<std::int64_t>(counts.overflows);
  stats.balancings += static_cast<std::int64_t>(counts.rounds);
  count_idle(counts.ms_present - counts.ms_waited, watch.lap(), stats);
  unexpanded_.clear();
  for (const auto& worker : workers_)
    unexpanded_.insert(unexpanded_.end(), worker->unexpanded.begin(), worker->unexpanded.end());
  if (!keeps_front || !unexpanded_.empty()) return;
  keep_front(stats.front_reused);
  stats.ms_front = watch.lap();
}

void CpuDetector::keep_front(bool reused) {
  front_.clear();
  for (const auto& worker : workers_)
    front_.insert(front_.end(), worker->front.begin(), worker->front.end());
  front_policy_.saved(front_.size(), reused);
}

// Computes the idle share from the wall time of a traversal and the sum of the times that the
// workers were busy. Both are in milliseconds.
void CpuDetector::count_idle(double busy, double wall, Stats& stats) const {
  if (wall <= 0) return;
  stats.idle_share = std::max(0.0, 1 - busy / (wall * pool_.available()));
  stats.ms_balance = stats.idle_share * wall;
}

}  // namespace lazyccd
