// What the CPU backend does with a pair of nodes.
#pragma once

#include "core/bvh/node_pair.h"
#include "cpu/cpu_detector.h"
#include "cpu/detector_worker.h"
#include "cpu/node_culling.h"
#include "host/threads/noinit_vector.h"
#include "simd/inline.h"

namespace lazyccd {

/// Visits pairs of nodes for a traversal (da Silva, Algorithm 2.1): a pair of overlapping nodes is
/// replaced by pairs of children, down to pairs of leaves. Any number of workers at once, each with
/// a number of its own. Inlined into the loop over the pairs: a call for each of them can be felt.
class PairVisitor {
 public:
  /// keeps_front: records the pairs where the traversal ends.
  PairVisitor(CpuDetector& detector, bool keeps_front)
      : detector_(detector),
        nodes_(detector.hierarchy_.tree().nodes().data()),
        culling_(detector.hierarchy_.culling()),
        keeps_front_(keeps_front) {}

  /// Visits a pair. Calls emit(pair) for the pairs that it leads to.
  template <class Emit>
  LAZYCCD_INLINE void operator()(int id, NodePair pair, Emit& emit) const {
    CpuDetector::Worker& worker = *detector_.workers_[id];
    // Relaxed: a worker that sees the flag late only visits a few more pairs.
    if (detector_.is_interrupted_.load(std::memory_order_relaxed))
      return worker.unexpanded.push_back(pair);
    if (culling_ && pair.a == pair.b && culling_->apart_from_itself(pair.a, detector_.records_)) {
      ++worker.flat;
      return end(worker, pair);
    }
    PairVisit v = visit(pair, nodes_[pair.a], nodes_[pair.b]);
    if (v.overlaps && is_skipped(pair)) v = {false, 0, {}};
    if (v.overlaps && is_culled(worker, pair)) v = {false, 0, {}};
    for (int i = 0; i < v.children; ++i) emit(v.child[i]);
    if (v.children != 0) return;
    end(worker, pair);
    if (v.overlaps) visit_groups(worker, pair);
  }

  const NoinitVector<TreeNode>& nodes() const { return detector_.hierarchy_.tree().nodes(); }
  /// Whether the culling rules a pair of overlapping nodes out. Counts it.
  bool is_culled(int id, NodePair pair) const { return is_culled(*detector_.workers_[id], pair); }
  /// Finds the candidates of a pair of overlapping leaves.
  void visit_leaves(int id, NodePair pair) const {
    if (!is_skipped(pair)) visit_groups(*detector_.workers_[id], pair);
  }

 private:
  LAZYCCD_INLINE bool is_skipped(NodePair pair) const {
    return detector_.is_excluded(pair) || detector_.is_known(pair);
  }
  bool is_culled(CpuDetector::Worker& worker, NodePair pair) const {
    if (!culling_ || pair.a == pair.b || !culling_->apart(pair.a, pair.b)) return false;
    ++worker.culled;
    return true;
  }
  // Records that the traversal ends at a pair.
  void end(CpuDetector::Worker& worker, NodePair pair) const {
    ++worker.ended;
    if (keeps_front_) worker.front.push_back(pair);
  }
  LAZYCCD_INLINE void visit_groups(CpuDetector::Worker& worker, NodePair pair) const {
    const std::int32_t a = nodes_[pair.a].group(), b = nodes_[pair.b].group();
    if (!detector_.kernels_->visit(worker.scene(), a, b, worker) ||
        detector_.hierarchy_.both_rest(pair))
      return;
    ++worker.group_pairs;
    if (detector_.list_state_ != CpuDetector::ListState::off)
      worker.listable += detector_.verlet_list_.would_list(pair);
  }

  CpuDetector& detector_;
  const TreeNode* nodes_;
  const NodeCulling* culling_;  // null: boxes only
  bool keeps_front_;
};

}  // namespace lazyccd
