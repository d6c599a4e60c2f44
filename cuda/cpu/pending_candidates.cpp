// The last stage of the CPU backend: tests the candidates that the traversal left, on all threads.
#include <atomic>
#include <vector>

#include "core/narrow/contact_math.h"
#include "core/narrow/decision.h"
#include "core/profile.h"
#include "cpu/cpu_detector.h"
#include "cpu/detector_worker.h"
#include "cpu/narrow/candidate_batches.h"
#include "lazyccd/debug/assert.h"

namespace lazyccd {
namespace {

// Returns whether the filters let the bodies of the pair collide, and no axis separates its
// primitives during the whole step.
template <ContactKind kind>
bool may_touch(const Mesh& mesh, const std::vector<VertexRecord>& records, Candidate pair) {
  Contact contact;
  identify_contact<kind>(mesh.view(), pair, contact);
  if (!mesh.collide(contact.body_a, contact.body_b)) return false;
  QueryCoordinates q;
  for (int i = 0; i < 4; ++i) {
    const double* x = records[contact.vertices[i]].x;
    q.start[i] = {x[0], x[1], x[2]};
    q.end[i] = {x[3], x[4], x[5]};
  }
  return !separated_along_axes<kind>(q);
}

}  // namespace

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

void CpuDetector::test_orphans(Stats& stats) {
  for (const auto& worker : workers_) worker->exclude(nullptr);
  std::atomic<std::int64_t> near{0};
  const auto test = [&](ContactKind kind, Candidate pair, Worker& worker) {
    const bool vf = kind == ContactKind::vertex_face;
    if (!(vf ? may_touch<ContactKind::vertex_face>(*mesh_, records_, pair)
             : may_touch<ContactKind::edge_edge>(*mesh_, records_, pair)))
      return false;
    worker.push(kind, pair);
    return true;
  };
  for (const ContactKind kind : {ContactKind::vertex_face, ContactKind::edge_edge}) {
    if (!(kind == ContactKind::vertex_face ? options_.vertex_face : options_.edge_edge)) continue;
    const OrphanList orphans = orphans_.of(kind);
    pool_.parallel_for(orphans.count, 1024, [&](std::size_t first, std::size_t last, int id) {
      std::int64_t pushed = 0;
      for (std::size_t i = first; i < last; ++i)
        pushed += test(kind, orphans.pairs[i], *workers_[id]);
      near.fetch_add(pushed, std::memory_order_relaxed);  // read after the end of the job
    });
  }
  test_pending(false);
  stats.orphan_tests = near.load(std::memory_order_relaxed);
}

}  // namespace lazyccd
