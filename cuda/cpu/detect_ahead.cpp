// Detection ahead: it begins before the end of its step is known. Pairs within the separation at
// the start of the step depend on the start only. All other candidates are searched with boxes that
// are wider by the tolerance of the end, and tested when the end is known.
#include <array>
#include <exception>

#include "core/profile.h"
#include "cpu/cpu_detector.h"
#include "cpu/detector_worker.h"
#include "cpu/narrow/candidate_batches.h"
#include "host/scene/positions.h"
#include "host/scene/scale.h"
#include "lazyccd/debug/stopwatch.h"

namespace lazyccd {

void CpuDetector::detect_ahead(const Positions& start, const Positions& end, double tolerance,
                               const Stats& stats) {
  discard_ahead();
  // Only boxes have a margin for the tolerance.
  if (pool_.is_serial() || pool_.has_submitted() || traversal_->needs_everyone() ||
      hierarchy_.culling() || !mesh_ ||
      !(options_.separation > 0 && tolerance >= 0 && tolerance <= options_.separation))
    return;
  ahead_job_ = [this, start, end, tolerance](int) { run_ahead(start, end, tolerance); };
  ahead_stats_ = stats;
  keep_last_motion();
  is_interrupted_.store(false, std::memory_order_relaxed);  // submit() publishes it
  is_running_ahead_ = near_pairs_lost_ = true;
  pool_.submit(ahead_job_);
}

// Runs the detection on one worker while the caller goes on, until it is interrupted.
void CpuDetector::run_ahead(const Positions& start, const Positions& end, double tolerance) {
  LAZYCCD_NVTX_RANGE("detect ahead");
  scale_ = scale_for(load_records(*mesh_, start, end, pool_, records_));
  tolerance_ = tolerance;
  search(ahead_stats_);
  // Sorted here, the contacts are contiguous, so the caller's core reads them faster than from the
  // buffers of the workers.
  are_sorted_ = !is_interrupted_.load(std::memory_order_relaxed);
  if (!are_sorted_) return;
  ahead_stats_.hash = sort_contacts(contacts_);
  for (const auto& worker : workers_) worker->forget_contacts();
}

// Interrupts the job and waits for it. Returns whether a worker ran it, so that there is a result.
bool CpuDetector::join_ahead() {
  if (!is_running_ahead_) return has_ahead_result_;
  is_interrupted_.store(true, std::memory_order_relaxed);
  try {
    has_ahead_result_ = pool_.join_submitted();
  } catch (const std::exception&) {
    // detect() reports errors of the positions that it is given. Unfinished work is done again.
    has_ahead_result_ = false;
    hierarchy_.forget();
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

// Returns whether the start is the same as that of the detection ahead, and every vertex ends
// within the tolerance.
bool CpuDetector::matches_ahead(const Positions& start, const Positions& end) const {
  if (start.count() != records_.size() || end.count() != records_.size()) return false;
  // Relative to the tolerance: its square could underflow or overflow.
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

// Returns the number of pairs of nodes and candidates that are still to be visited or tested.
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

// Completes the detection that was started ahead. The end of the step is known now.
void CpuDetector::resume(Stats& stats) {
  LAZYCCD_NVTX_RANGE("resume");
  Stopwatch watch;
  stats.ms_refit = stats.ms_balance = stats.ms_front = 0;
  for (const auto& worker : workers_) {
    worker->resume(leaf_scene(options_.separation, *worker));
    worker->unexpanded.clear();
  }
  if (!unexpanded_.empty()) {
    const std::vector<NodePair> initial = std::move(unexpanded_);
    traverse_from(initial, stats);
  }
  test_pending(false);
  for (const auto& worker : workers_) worker->stop_listing();
  CandidateBatches batches(static_cast<std::size_t>(count_undone()), pool_.available());
  for (const ContactKind kind : {ContactKind::vertex_face, ContactKind::edge_edge})
    for (const auto& worker : workers_) batches.add(kind, worker->deferred[static_cast<int>(kind)]);
  test(batches);
  stats.ms_traverse = watch.lap();
}

}  // namespace lazyccd
