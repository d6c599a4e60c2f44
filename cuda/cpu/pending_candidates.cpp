// The last stage of the CPU backend: tests the candidates that the traversal left, on all threads.

#include "core/profile.h"
#include "cpu/cpu_detector.h"
#include "cpu/detector_worker.h"
#include "cpu/narrow/candidate_batches.h"
#include "lazyccd/debug/assert.h"

namespace lazyccd {

// Tests the candidates that are left in the workers' queues and the pending ones. With `listed`,
// tests the candidates of the Verlet list too.
void CpuDetector::test_pending(bool listed) {
  constexpr ContactKind kinds[] = {ContactKind::vertex_face, ContactKind::edge_edge};
  std::size_t rest = 0;
  for (const auto& worker : workers_) {
    for (const CandidateQueue& queue : worker->queues) {
      LAZYCCD_ASSERT(queue.count >= 0 && queue.count <= CandidateQueue::capacity,
                     "queues of candidates hold what fits");
      rest += static_cast<std::size_t>(queue.count);
    }
    for (const std::vector<Candidate>& pairs : worker->pending) rest += pairs.size();
  }
  if (listed) {
    verlet_list_.measure_distances([this](NodePair pair) { return hierarchy_.both_rest(pair); });
    rest += verlet_list_.size();
  }
  CandidateBatches batches(rest, pool_.available());
  for (const ContactKind kind : kinds) {
    for (const auto& worker : workers_) {
      CandidateQueue& queue = worker->queues[static_cast<int>(kind)];
      batches.add(kind, queue.items, static_cast<std::size_t>(queue.count));
      queue.count = 0;
      if (!is_running_ahead_) batches.add(kind, worker->pending[static_cast<int>(kind)]);
    }
    if (!listed) continue;
    for (const ListedPairs& part : verlet_list_.parts()) batches.add(kind, part);
  }
  test(batches);
}

void CpuDetector::test(const CandidateBatches& batches) {
  LAZYCCD_NVTX_RANGE("elementary tests");
  pool_.parallel_for(
      batches.size(), batches.grain(), [&](std::size_t first, std::size_t last, int id) {
        for (std::size_t i = first; i < last; ++i) {
          const CandidateBatch& batch = batches[i];
          const int count = static_cast<int>(batch.count);
          if (batch.listed) {
            workers_[id]->process_listed(*batch.part, batch.kind, batch.listed, count);
          } else {
            workers_[id]->process_queued(batch.kind, batch.queued, count);
          }
        }
      });
}

void CpuDetector::test_excluded(Stats& stats) {
  for (const auto& worker : workers_) worker->exclude(nullptr);
  excluded_->push_to({narrow_phases_.data(), narrow_phases_.size()}, records_, pool_, stats);
  test_pending(false);
}

}  // namespace lazyccd
