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

void CpuDetector::foresee(const Positions& start, const Positions& end, double tolerance,
                          const Stats& stats) {
  forget_foreseen();
  // Rounds of static_list end when all threads have come; volumes have no room for a tolerance.
  if (pool_.size() == 1 || options_.strategy == Strategy::static_list || volume_ || !mesh_ ||
      !(options_.separation > 0 && tolerance >= 0 && tolerance <= options_.separation))
    return;
  foresight_ = [this, start, end, tolerance](int) { begin_to_foresee(start, end, tolerance); };
  foreseen_stats_ = stats;
  is_interrupted_.store(false, std::memory_order_relaxed);  // hand_out() publishes it
  is_foreseeing_ = near_is_lost_ = true;
  pool_.hand_out(foresight_);
}

// On one thread beside the caller, until it is interrupted.
void CpuDetector::begin_to_foresee(const Positions& start, const Positions& end, double tolerance) {
  scale_ = scale_for(load_records(*mesh_, start, end, pool_, records_));
  tolerance_ = tolerance;
  seek(foreseen_stats_);
  // Read in order, they come to the caller's core faster than from where they were found.
  are_sorted_ = !is_interrupted_.load(std::memory_order_relaxed);
  if (!are_sorted_) return;
  foreseen_stats_.hash = sort_contacts(contacts_);
  for (const auto& worker : workers_) worker->forget_contacts();
}

// Whether anything was foreseen.
bool CpuDetector::await_foreseen() {
  if (!is_foreseeing_) return has_foreseen_;
  is_interrupted_.store(true, std::memory_order_relaxed);
  try {
    has_foreseen_ = pool_.take_back();
  } catch (const std::exception&) {
    // Of the positions that it is given, detect() is to speak. Whatever was half done is done anew.
    has_foreseen_ = built_ = false;
    near_list_.forget();
  }
  is_interrupted_.store(false, std::memory_order_relaxed);
  is_foreseeing_ = false;
  return has_foreseen_;
}

void CpuDetector::forget_foreseen() {
  await_foreseen();
  has_foreseen_ = false;
}

bool CpuDetector::is_as_foreseen(const Positions& start, const Positions& end) const {
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
  std::size_t count = unopened_.size();
  for (const auto& worker : workers_) {
    for (const ContactKind kind : {ContactKind::vertex_face, ContactKind::edge_edge}) {
      const int k = static_cast<int>(kind);
      count += worker->put_off[k].size() + worker->left_over[k].size() +
               static_cast<std::size_t>(worker->queues[k].count);
    }
  }
  return static_cast<std::int64_t>(count);
}

void CpuDetector::go_on(Stats& stats) {
  Stopwatch watch;
  stats.ms_refit = stats.ms_balance = stats.ms_front = 0;
  for (const auto& worker : workers_) {
    worker->go_on(leaf_scene(options_.separation, *worker));
    worker->unopened.clear();
  }
  if (!unopened_.empty()) {
    const std::vector<NodePair> initial = std::move(unopened_);
    balanced_traversal(initial, stats);
  }
  test_rest(false);
  for (const auto& worker : workers_) worker->go_on_with_put_off();
  Pieces pieces(static_cast<std::size_t>(count_undone()), pool_.available());
  for (const ContactKind kind : {ContactKind::vertex_face, ContactKind::edge_edge})
    for (const auto& worker : workers_) pieces.add(kind, worker->put_off[static_cast<int>(kind)]);
  test(pieces);
  stats.ms_traverse = watch.lap();
}

}  // namespace lazyccd
