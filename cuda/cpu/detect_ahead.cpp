// A detection that begins before the end of its step is known. What is near where the step begins
// needs no more than the start; what else may come near is sought with as much more room as the
// end is unknown, and tested once it is known.
#include <array>
#include <exception>

#include "cpu/cpu_detector.h"
#include "cpu/detector_worker.h"
#include "cpu/narrow/candidate_batches.h"
#include "cpu/scene/positions.h"
#include "cpu/scene/scale.h"
#include "cpu/stopwatch.h"

namespace lazyccd {

void CpuDetector::detect_ahead(const Positions& start, const Positions& end, double tolerance,
                          const Stats& stats) {
  discard_ahead();
  // Rounds of static_list end when all threads have come; volumes have no room for a tolerance.
  if (pool_.size() == 1 || pool_.has_submitted() ||
      options_.algorithm.strategy == Strategy::static_list || volume_ || !mesh_ ||
      !(options_.separation > 0 && tolerance >= 0 && tolerance <= options_.separation))
    return;
  ahead_job_ = [this, start, end, tolerance](int) { run_ahead(start, end, tolerance); };
  ahead_stats_ = stats;
  is_interrupted_.store(false, std::memory_order_relaxed);  // submit() publishes it
  is_running_ahead_ = near_is_lost_ = true;
  pool_.submit(ahead_job_);
}

// On one thread beside the caller, until it is interrupted.
void CpuDetector::run_ahead(const Positions& start, const Positions& end, double tolerance) {
  scale_ = scale_for(load_records(*mesh_, start, end, pool_, records_));
  tolerance_ = tolerance;
  search(ahead_stats_);
  // Read in order, they come to the caller's core faster than from where they were found.
  are_sorted_ = !is_interrupted_.load(std::memory_order_relaxed);
  if (!are_sorted_) return;
  ahead_stats_.hash = sort_contacts(contacts_);
  for (const auto& worker : workers_) worker->forget_contacts();
}

// Whether anything was started_ahead.
bool CpuDetector::join_ahead() {
  if (!is_running_ahead_) return has_ahead_result_;
  is_interrupted_.store(true, std::memory_order_relaxed);
  try {
    has_ahead_result_ = pool_.join_submitted();
  } catch (const std::exception&) {
    // Of the positions that it is given, detect() is to speak. Whatever was half done is done anew.
    has_ahead_result_ = built_ = false;
    verlet_list_.forget();
  }
  is_interrupted_.store(false, std::memory_order_relaxed);
  is_running_ahead_ = false;
  return has_ahead_result_;
}

void CpuDetector::discard_ahead() {
  join_ahead();
  has_ahead_result_ = false;
}

bool CpuDetector::matches_ahead(const Positions& start, const Positions& end) const {
  if (start.count() != records_.size() || end.count() != records_.size()) return false;
  // Not squared by itself: it may be as small or as large as numbers are.
  const double unit = 1 / tolerance_;
  for (std::size_t v = 0; v < records_.size(); ++v) {
    const double* const x = records_[v].x;
    const std::array<double, 3> a = start[v], b = end[v];
    double off = 0;
    for (int k = 0; k < 3; ++k) {
      const double moved = b[k] - x[3 + k];
      if (moved != 0) off += unit * moved * (unit * moved);
    }
    if (!(a[0] == x[0] && a[1] == x[1] && a[2] == x[2] && off <= 1)) return false;
  }
  return true;
}

// Pairs of nodes and candidates.
std::int64_t CpuDetector::count_undone() const {
  std::size_t count = unexpanded_.size();
  for (const auto& worker : workers_) {
    for (const ContactKind kind : {ContactKind::vertex_face, ContactKind::edge_edge}) {
      const int k = static_cast<int>(kind);
      count += worker->deferred[k].size() + worker->pending[k].size() +
               static_cast<std::size_t>(worker->queues[k].count);
    }
  }
  return static_cast<std::int64_t>(count);
}

void CpuDetector::resume(Stats& stats) {
  Stopwatch watch;
  stats.ms_refit = stats.ms_balance = stats.ms_front = 0;
  for (const auto& worker : workers_) {
    worker->resume(leaf_scene(options_.separation, *worker));
    worker->unexpanded.clear();
  }
  if (!unexpanded_.empty()) {
    const std::vector<NodePair> initial = std::move(unexpanded_);
    balanced_traversal(initial, stats);
  }
  test_pending(false);
  for (const auto& worker : workers_) worker->resume_deferred();
  CandidateBatches batches(static_cast<std::size_t>(count_undone()), pool_.available());
  for (const ContactKind kind : {ContactKind::vertex_face, ContactKind::edge_edge})
    for (const auto& worker : workers_) batches.add(kind, worker->deferred[static_cast<int>(kind)]);
  test(batches);
  stats.ms_traverse = watch.lap();
}

}  // namespace lazyccd
