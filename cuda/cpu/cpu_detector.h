// The CPU backend: refit, traverse by one of the strategies, filter in lanes, decide, sort.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <vector>

#include "core/front_policy.h"
#include "cpu/backend.h"
#include "cpu/narrow/contact_sort.h"
#include "cpu/bvh/groups.h"
#include "cpu/narrow/leaf_kernels.h"
#include "cpu/verlet/verlet_list.h"
#include "cpu/bvh/node_volume.h"
#include "cpu/culling/normal_cones.h"
#include "cpu/culling/orphan_sets.h"
#include "cpu/threads/thread_pool.h"
#include "cpu/balance/traversal_run.h"
#include "cpu/bvh/tree.h"
#include "lazyccd/detector.h"

namespace lazyccd {

class CandidateBatches;

class CpuDetector : public BackendDetector {
 public:
  CpuDetector(const DetectorOptions& options, const Threads& threads,
              const LeafKernels& kernels = *best_leaf_kernels());
  explicit CpuDetector(const DetectorOptions& options,
                       const LeafKernels& kernels = *best_leaf_kernels())
      : CpuDetector(options, Threads(options.threads), kernels) {}
  ~CpuDetector() override;

  void set_mesh(const Mesh& mesh) override;
  Span<const Contact> detect(const Positions& start, const Positions& end, Stats& stats) override;
  // Of the contacts of a detection by another backend, with a separation, those that
  // DetectorOptions::distinct leaves; notes all of them for recheck_near_pairs().
  Span<const Contact> reduce_contacts(Span<const Contact> contacts, const Positions& start,
                                  const Positions& end, Stats& stats);
  // As Detector::recheck_near_pairs().
  Span<const Contact> recheck_near_pairs(const Positions& start, const Positions& end, Stats& stats);
  // As Detector::detect_ahead(). The stats are those that the detection begins with.
  void detect_ahead(const Positions& start, const Positions& end, double tolerance, const Stats& stats);
  // To be called before the mesh changes.
  void discard_ahead();

 private:
  struct Worker;

  // A step with so few candidates to test is done sooner than another thread would have come to it.
  bool is_small(std::int64_t candidates) const {
    return candidates < few_candidates && records_.size() < few_vertices;
  }
  static constexpr std::int64_t few_candidates = 750;
  static constexpr std::size_t few_vertices = 4096;

  void search(Stats& stats);
  std::int64_t count_searched() const;
  void update_hierarchy(Stats& stats);
  LeafScene leaf_scene(double separation, Worker& worker) const;
  void begin_workers(double separation);
  std::uint64_t sort_contacts(std::vector<Contact>& out);
  void gather_contacts(std::vector<Contact>& out, Stats& stats);
  void traverse(Stats& stats);
  void look_ahead();
  bool may_list() const;
  bool is_listed(NodePair pair) const { return serving_ && verlet_list_.holds(pair); }
  void balanced_traversal(Span<const NodePair> initial, Stats& stats);
  void query_each_group(Stats& stats);
  void visit_pair(Worker& worker, NodePair pair);
  void find_parts();
  bool may_meet(NodePair pair) const;
  std::int64_t count_near() const;
  bool stay_apart() const;
  void test_pending(bool listed);
  void test(const CandidateBatches& batches);
  void test_orphans(Stats& stats);
  void keep_front(bool reused);
  void count_idle(double busy, double wall, Stats& stats) const;
  std::int64_t bytes() const;

  // Of foresight.cpp:
  void run_ahead(const Positions& start, const Positions& end, double tolerance);
  bool join_ahead();
  bool matches_ahead(const Positions& start, const Positions& end) const;
  std::int64_t count_undone() const;
  void resume(Stats& stats);

  DetectorOptions options_;
  const LeafKernels* kernels_;
  Threads threads_;
  ThreadPool& pool_;  // of threads_
  TraversalRun traversal_;
  std::vector<std::unique_ptr<Worker>> workers_;

  const Mesh* mesh_ = nullptr;
  bool built_ = false;
  // In this step: a list of what is near is made; or serves; or, without one, would it last?
  bool listing_ = false, serving_ = false, looking_ = false;
  double built_cost_ = 0;                 // the tree's cost when it was built
  std::int64_t tested_ = few_candidates;  // candidates of the last step
  double scale_ = 1;
  double tolerance_ = 0;  // of the positions at the end, metres
  std::vector<VertexRecord> records_;
  Groups groups_;
  Tree tree_;
  // What is below a node of the tree.
  struct Part {
    std::int32_t body;  // -1: several
    bool pinned;        // all of it
  };
  std::vector<Part> parts_;  // by node
  std::unique_ptr<NodeVolume> volume_;
  NormalCones cones_;
  OrphanSets orphans_;
  std::unique_ptr<ContactSort> sort_;
  std::vector<Contact> contacts_, touching_;

  std::function<void(int)> ahead_job_;  // what another thread does, while it foresees
  bool is_running_ahead_ = false, has_ahead_result_ = false;
  bool near_is_lost_ = false;  // of the last detection: it made room for what was started_ahead
  std::atomic<bool> is_interrupted_{false};
  bool are_sorted_ = false;  // the contacts that were started_ahead
  Stats ahead_stats_;
  std::vector<Contact> others_;     // than those, to be sorted among them
  std::vector<NodePair> unexpanded_;  // when it was interrupted

  std::vector<NodePair> front_;
  FrontPolicy front_policy_;
  VerletList verlet_list_;
};

}  // namespace lazyccd
