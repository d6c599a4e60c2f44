// The re-check of near pairs for another motion with the same start.
#include <algorithm>
#include <cmath>

#include "core/narrow/separation.h"
#include "core/profile.h"
#include "cpu/cpu_detector.h"
#include "cpu/detector_worker.h"
#include "host/scene/positions.h"
#include "host/scene/scale.h"
#include "lazyccd/debug/assert.h"
#include "lazyccd/debug/stopwatch.h"
#include "lazyccd/error.h"

namespace lazyccd {

Span<const Contact> CpuDetector::recheck_near_pairs(const Positions& start, const Positions& end,
                                                    Stats& stats) {
  LAZYCCD_NVTX_RANGE("re-check");
  Stopwatch total;
  if (near_pairs_lost_)
    throw Error(
        ErrorCode::invalid_argument,
        "recheck_near_pairs() after detect_ahead(), set_resting() or a failed detection: the "
        "near pairs of the last detection are lost");
  keep_last_motion();
  list_state_ = ListState::off;
  is_rechecking_ = false;
  scale_ = scale_for(load_records(*mesh_, start, end, pool_, records_));
  stats.ms_refit = total.lap();
  begin_workers(0);
  const bool deviates = can_recheck_any_motion() && !stays_near_motion(stats);
  if (deviates || !stay_apart()) {
    // The workers share the near pairs of each worker.
    for (const auto& from : workers_) {
      for (const ContactKind kind : {ContactKind::vertex_face, ContactKind::edge_edge}) {
        const std::vector<Candidate>& pairs = from->near_pairs.of[static_cast<int>(kind)];
        pool_.parallel_for(pairs.size(), 2048, [&](std::size_t first, std::size_t last, int id) {
          for (std::size_t i = first; i < last; ++i) {
            if (!deviates || is_known(verlet_list_.leaves().owners_of(kind, pairs[i])))
              workers_[id]->push(kind, pairs[i]);
          }
        });
      }
    }
    stats.searched_again = deviates;
    if (deviates) search_again(stats);
    test_pending(false);
  }
  is_rechecking_ = false;
  gather_contacts(rechecked_, stats);
  stats.ms_total = stats.ms_refit + total.lap();
  return rechecked_;
}

// Measures how the loaded motion deviates from that of the last detection, which has the same
// start. Returns whether no pair that was not near in that one can touch in this one. If some can,
// is_known() tells which pairs of nodes cannot.
bool CpuDetector::stays_near_motion(Stats& stats) {
  Stopwatch watch;
  if (std::all_of(records_.begin(), records_.end(), [](const VertexRecord& record) {
        return std::equal(record.x, record.x + 3, record.x + 3);
      }))
    return true;  // what touches at the start was near
  LAZYCCD_ASSERT(last_motion_.size() == records_.size(),
                 "the motion of the last detection is of the same vertices");
  deviation_.measure(last_motion_, records_, scale_, verlet_list_.leaves(), hierarchy_.tree(),
                     pool_);
  is_rechecking_ = true;
  stats.ms_refit += watch.lap();
  return is_known({0, 0});
}

// The near pairs are all that came within their separations. Any other pair cannot touch if it
// deviates by less than its separation.
bool CpuDetector::deviates_little(NodePair pair) const {
  const float least = hierarchy_.least_self_separation(pair);
  const Separations separation{options_.separation, mesh_->self_separation()};
  // A square outside of the bounds is not exact enough. The upper bound makes the limit smaller and
  // does not refuse it: a leaf must not have a smaller limit than the nodes above it.
  const double limit = std::min(separation.within(least, least) * scale_ * (1 - 0x1p-20), 0x1p399);
  return limit > 0x1p-400 && deviation_.difference_squared(pair) <= limit * limit;
}

// Finds the candidates of the pairs of nodes that deviate too much for the near pairs.
void CpuDetector::search_again(Stats& stats) {
  LAZYCCD_NVTX_RANGE("search again");
  Stopwatch watch;
  hierarchy_.refit(records_, scale_, separation_margin(0), pool_);
  stats.ms_refit += watch.lap();
  const NodePair root{0, 0};
  traverse_from({&root, 1}, stats);
}

// Returns whether no near pair can touch, because the displacements of all vertices differ by less
// than the smallest distance of a near pair.
bool CpuDetector::stay_apart() const {
  double lo[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  // Scaled, so that squares of displacements do not underflow.
  const double min_distance = nearest_ * scale_;
  if (!(min_distance > 0x1p-400)) return false;
  for (const VertexRecord& record : records_) {
    for (int k = 0; k < 3; ++k) {
      const double moved = (record.x[3 + k] - record.x[k]) * scale_;
      lo[k] = std::min(lo[k], moved);
      hi[k] = std::max(hi[k], moved);
    }
  }
  double squared = 0;
  for (int k = 0; k < 3; ++k) squared += (hi[k] - lo[k]) * (hi[k] - lo[k]);
  return std::sqrt(squared) * (1 + 0x1p-20) < min_distance;
}

}  // namespace lazyccd
