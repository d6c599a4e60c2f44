// The traversal stage of the CPU backend: from the root, or a front, to pairs of groups.
#include <algorithm>
#include <atomic>

#include "core/profile.h"
#include "cpu/cpu_detector.h"
#include "cpu/detector_worker.h"
#include "lazyccd/debug/stopwatch.h"

namespace lazyccd {

void CpuDetector::traverse(Stats& stats) {
  LAZYCCD_NVTX_RANGE("traverse");
  if (options_.algorithm.culling.orphan_sets) {
    for (const auto& worker : workers_) worker->exclude(&orphans_);
  }
  if (hierarchy_.tree().nodes().empty()) return;
  if (options_.algorithm.strategy == Strategy::thread_per_query) {
    query_each_group(stats);
  } else {
    const NodePair root{0, 0};
    stats.front_reused = options_.algorithm.front == FrontUse::on && front_policy_.reuse();
    if (stats.front_reused) {
      balanced_traversal(front_, stats);
    } else {
      balanced_traversal({&root, 1}, stats);
    }
  }
  test_pending(list_state_ == ListState::in_use);
  if (options_.algorithm.culling.orphan_sets) test_orphans(stats);
}

// Traverses the tree from the initial pairs (da Silva, Algorithm 2.1): a pair of overlapping nodes
// is replaced by pairs of children, down to pairs of leaves.
void CpuDetector::balanced_traversal(Span<const NodePair> initial, Stats& stats) {
  const TreeNode* nodes = hierarchy_.tree().nodes().data();
  const bool keep = options_.algorithm.front == FrontUse::on && !is_rechecking_,
             cones = options_.algorithm.culling.normal_cones;
  const NodeVolume* volume = hierarchy_.volume();
  stats.front_start = static_cast<std::int64_t>(initial.size());
  Stopwatch watch;
  const RunCounts counts =
      traversal_.run(initial.data(), initial.size(), [&](int id, NodePair pair, auto& emit) {
        Worker& worker = *workers_[id];
        // Relaxed: a worker that sees the flag late only visits a few more pairs.
        if (is_interrupted_.load(std::memory_order_relaxed))
          return worker.unexpanded.push_back(pair);
        if (cones && pair.a == pair.b && hierarchy_.cones().apart_from_itself(pair.a, records_)) {
          ++worker.flat;
          ++worker.ended;
          if (keep) worker.front.push_back(pair);
          return;
        }
        PairVisit v = visit(pair, nodes[pair.a], nodes[pair.b]);
        if (v.overlaps && (is_excluded(pair) || is_known(pair))) v = {false, 0, {}};
        if (volume && v.overlaps && pair.a != pair.b && volume->apart(pair.a, pair.b)) {
          ++worker.culled;
          v = {false, 0, {}};
        }
        for (int i = 0; i < v.children; ++i) emit(v.child[i]);
        if (v.children != 0) return;
        ++worker.ended;
        if (keep) worker.front.push_back(pair);
        if (v.overlaps) visit_pair(worker, pair);
      });
  stats.tree_tests += static_cast<std::int64_t>(counts.items);
  stats.steals += static_cast<std::int64_t>(counts.steals);
  stats.overflows += static_cast<std::int64_t>(counts.overflows);
  stats.balancings += static_cast<std::int64_t>(counts.rounds);
  count_idle(counts.ms_present - counts.ms_waited, watch.lap(), stats);
  unexpanded_.clear();
  for (const auto& worker : workers_)
    unexpanded_.insert(unexpanded_.end(), worker->unexpanded.begin(), worker->unexpanded.end());
  if (!keep || !unexpanded_.empty()) return;
  keep_front(stats.front_reused);
  stats.ms_front = watch.lap();
}

void CpuDetector::visit_pair(Worker& worker, NodePair pair) {
  const std::int32_t a = hierarchy_.tree().nodes()[pair.a].group(),
                     b = hierarchy_.tree().nodes()[pair.b].group();
  if (!kernels_->visit(worker.scene(), a, b, worker) || hierarchy_.both_rest(pair)) return;
  ++worker.group_pairs;
  if (list_state_ != ListState::off) worker.listable += verlet_list_.would_list(pair);
}

void CpuDetector::query_each_group(Stats& stats) {
  const NoinitVector<TreeNode>& nodes = hierarchy_.tree().nodes();
  Stopwatch watch;
  std::atomic<std::int64_t> tests{0};
  pool_.parallel_for(nodes.size(), 64, [&](std::size_t first, std::size_t last, int id) {
    Worker& worker = *workers_[id];
    Stopwatch busy;
    std::vector<std::uint32_t> stack;
    std::int64_t tested = 0;
    for (std::size_t query = first; query < last; ++query) {
      const TreeNode& q = nodes[query];
      if (!q.leaf()) continue;
      const auto self = static_cast<std::uint32_t>(query);
      if (!is_excluded({self, self}) && !is_known({self, self})) visit_pair(worker, {self, self});
      stack.push_back(0);
      while (!stack.empty()) {
        const std::uint32_t other = stack.back();
        stack.pop_back();
        const TreeNode& n = nodes[other];
        ++tested;
        if (!overlap(q, n)) continue;
        if (hierarchy_.volume() && self != other && hierarchy_.volume()->apart(self, other)) {
          ++worker.culled;
          continue;
        }
        if (!n.leaf()) {
          const ChildrenToVisit children =
              children_to_visit(nodes.data(), n, static_cast<std::int32_t>(self));
          for (int i = children.count; i-- > 0;)
            stack.push_back(static_cast<std::uint32_t>(children.node[i]));
        } else if (q.group() < n.group() && !is_excluded({self, other}) &&
                   !is_known({self, other})) {
          visit_pair(worker, {self, other});
        }
      }
    }
    tests.fetch_add(tested, std::memory_order_relaxed);  // read after the end of the job
    worker.ms_busy += busy.lap();
  });
  stats.tree_tests = tests.load(std::memory_order_relaxed);
  double busy = 0;
  for (const auto& worker : workers_) busy += worker->ms_busy;
  count_idle(busy, watch.lap(), stats);
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
