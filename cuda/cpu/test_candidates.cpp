// The last stage of the CPU backend: tests the candidates that the traversal left, on all threads.
#include <array>
#include <atomic>
#include <vector>

#include "core/narrow/contact_math.h"
#include "cpu/cpu_detector.h"
#include "cpu/detector_worker.h"
#include "cpu/narrow/candidate_batches.h"

namespace lazyccd {
namespace {

// Returns whether the first `split` of four vertices are on one side of the others along an axis,
// at both ends of the step and so during the whole step.
bool apart(const std::vector<VertexRecord>& records, const std::array<std::int32_t, 4>& vertices,
           int split) {
  for (int k = 0; k < 3; ++k) {
    bool below = true, above = true;
    for (int end = 0; end < 2; ++end) {
      for (int i = 0; i < split; ++i) {
        for (int j = split; j < 4; ++j) {
          const double a = records[vertices[i]].x[3 * end + k],
                       b = records[vertices[j]].x[3 * end + k];
          below = below && a < b;
          above = above && a > b;
        }
      }
    }
    if (below || above) return true;
  }
  return false;
}

}  // namespace

// Tests the candidates that are left in the workers' queues and the pending ones. With `listed`,
// tests the candidates of the Verlet list too.
void CpuDetector::test_pending(bool listed) {
  constexpr ContactKind kinds[] = {ContactKind::vertex_face, ContactKind::edge_edge};
  std::size_t rest = 0;
  for (const auto& worker : workers_) {
    for (const CandidateQueue& queue : worker->queues)
      rest += static_cast<std::size_t>(queue.count);
    for (const std::vector<Candidate>& pairs : worker->pending) rest += pairs.size();
  }
  if (listed) {
    verlet_list_.measure_distances();
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
    Contact c;
    if (kind == ContactKind::vertex_face) {
      identify_contact<ContactKind::vertex_face>(worker.scene().mesh, pair, c);
    } else {
      identify_contact<ContactKind::edge_edge>(worker.scene().mesh, pair, c);
    }
    const int split = kind == ContactKind::vertex_face ? 1 : 2;  // vertices of the first primitive
    if (!mesh_->collide(c.body_a, c.body_b) || apart(records_, c.vertices, split)) return false;
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
