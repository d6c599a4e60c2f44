// The CPU backend: refits the hierarchy, traverses it by one of the strategies, filters candidates
// in lanes, decides them, and sorts the contacts.
#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <vector>

#include "core/bvh/front_policy.h"
#include "cpu/hierarchy.h"
#include "cpu/narrow/contact_sort.h"
#include "cpu/narrow/excluded_pairs.h"
#include "cpu/strategies/traversal_run.h"
#include "cpu/verlet/verlet_list.h"
#include "host/backend.h"
#include "host/kernels/leaf_kernels.h"
#include "host/threads/thread_pool.h"
#include "lazyccd/detector.h"
#include "lazyccd/export.h"

namespace lazyccd {

class CandidateBatches;

/// Detector on the CPU. See Detector (lazyccd/detector.h) for the meaning of the public functions.
class CpuDetector : public BackendDetector {
 public:
  CpuDetector(const DetectorOptions& options, const Threads& threads,
              const LeafKernels& kernels = *best_leaf_kernels());
  explicit CpuDetector(const DetectorOptions& options,
                       const LeafKernels& kernels = *best_leaf_kernels())
      : CpuDetector(options, Threads(options.threads), kernels) {}
  ~CpuDetector() override;

  void set_mesh(const Mesh& mesh) override;
  /// Call when the mesh has other resting bodies, after discard_ahead().
  void update_resting();
  Span<const Contact> detect(const Positions& start, const Positions& end, Stats& stats) override;
  /// Takes over what another backend found with a separation: for near_distances(), the distances
  /// of the near pairs, by body; for recheck_near_pairs(), then, the pairs, by ContactKind.
  void take_near_distances(Span<const double> of_pairs);
  void take_near_pairs(const std::array<Span<const Candidate>, 2>& pairs);
  /// As Detector::can_recheck_any_motion().
  bool can_recheck_any_motion() const {
    return !near_pairs_lost_ && !near_pairs_are_taken_ && hierarchy_.is_built() && may_list();
  }
  /// As Detector::near_distances().
  Span<const double> near_distances() const { return near_distances_; }
  /// As Detector::recheck_near_pairs().
  Span<const Contact> recheck_near_pairs(const Positions& start, const Positions& end,
                                         Stats& stats);
  /// Returns `contacts`, which this or another backend returned last: without a copy if they are in
  /// this one's memory, which `reuse` replaces then.
  std::vector<Contact> take_contacts(Span<const Contact> contacts, std::vector<Contact> reuse);
  /// As Detector::detect_ahead(). The detection starts with the values in `stats`.
  void detect_ahead(const Positions& start, const Positions& end, double tolerance,
                    const Stats& stats);
  /// Waits for what detect_ahead() started and discards it. Call it before the mesh changes.
  void discard_ahead();

 private:
  friend class PairVisitor;
  struct Worker;

  // What the Verlet list does in this step.
  enum class ListState {
    off,       // not used
    probing,   // there is no list; the step measures whether one would stay valid
    building,  // this step builds the list
    in_use     // this step uses the list
  };

  // Whether a step with this number of candidates wakes no thread: waking and waiting would cost
  // more processor time than the step gets shorter.
  bool is_small(std::int64_t candidates) const {
    return candidates < min_candidates_for_threads && records_.size() < min_vertices_for_threads;
  }
  static constexpr std::int64_t min_candidates_for_threads = 3000;
  static constexpr std::size_t min_vertices_for_threads = 4096;

  // Detects from the loaded positions to the contacts of the workers, which are not gathered yet.
  void search(Stats& stats);
  // Refits or rebuilds the hierarchy, with the Verlet list's skin if this step builds a list.
  void update_hierarchy(Stats& stats);
  // Returns the input of the kernels in this step. The worker counts what the filter rules out.
  LeafScene leaf_scene(double separation, Worker& worker) const;
  // Prepares all workers for a step with this minimum separation.
  void begin_workers(double separation);
  // Sorts the contacts of all workers into `out` and returns their hash.
  std::uint64_t sort_contacts(std::vector<Contact>& out);
  // Sorts the contacts of all workers into `out` and adds the workers' counters to the stats.
  void gather_contacts(std::vector<Contact>& out, Stats& stats);
  // Traverses the hierarchy and tests all candidates that this finds.
  void traverse(Stats& stats);
  // Tells the Verlet list how many of the visited pairs of groups a new list would hold.
  void record_list_use();
  // Returns whether the options allow Verlet lists.
  bool may_list() const;
  // Returns whether the traversal skips the pair, because of its bodies. A new Verlet list gets the
  // pairs of resting bodies too: it serves them when they move again.
  bool is_excluded(NodePair pair) const {
    return !hierarchy_.may_collide(pair) ||
           (list_state_ != ListState::building && hierarchy_.both_rest(pair));
  }
  // Returns whether all candidates below the pair are known, so that the traversal skips it: from
  // the Verlet list or, in a re-check, from the near pairs.
  bool is_known(NodePair pair) const {
    return is_rechecking_ ? deviates_little(pair)
                          : list_state_ == ListState::in_use && verlet_list_.covers(pair);
  }
  // Call it before another motion is loaded.
  void keep_last_motion();
  // Traverses from the initial pairs of nodes, by the strategy of the options.
  void traverse_from(Span<const NodePair> initial, Stats& stats);
  // Whether the mesh leaves out one of its primitives, or both bodies rest.
  // Sets number and distances of the near pairs of all workers.
  void describe_near(Stats& stats);
  void begin_near_distances();
  void add_near_distances(Span<const double> of_pairs);
  // Keeps the pairs where the traversal ended as the front of the next step.
  void keep_front(bool reused);
  // Sets the time that the workers were idle, from their busy time and the wall time, milliseconds.
  void count_idle(double busy, double wall, Stats& stats) const;
  // Returns the memory that the detector holds.
  std::int64_t bytes() const;

  // In pending_candidates.cpp.

  // Tests the queued and the pending candidates; with `listed`, those of the Verlet list too.
  void test_pending(bool listed);
  // Tests batches of candidates on all threads.
  void test(const CandidateBatches& batches);
  // Tests the pairs that the traversal leaves out.
  void test_excluded(Stats& stats);

  // In recheck.cpp.

  // Returns whether the near pairs have all candidates of the loaded motion.
  bool stays_near_motion(Stats& stats);
  // Returns whether a re-check knows all pairs below two nodes that can touch.
  LAZYCCD_API bool deviates_little(NodePair pair) const;
  // Finds the candidates of a re-check that are not known.
  void search_again(Stats& stats);
  // Returns whether the motion is so small that no near pair can touch.
  bool stay_apart() const;

  // In detect_ahead.cpp.

  // Runs the detection on one worker, until it is interrupted.
  void run_ahead(const Positions& start, const Positions& end, double tolerance);
  // Interrupts the job and waits for it. Returns whether there is a result.
  bool join_ahead();
  // Returns whether these positions are within what the detection ahead allows.
  bool matches_ahead(const Positions& start, const Positions& end) const;
  // Returns the number of pairs of nodes and candidates that are still to be processed.
  std::int64_t count_undone() const;
  // Completes the detection that was started ahead.
  void resume(Stats& stats);

  DetectorOptions options_;
  const LeafKernels* kernels_;
  Threads threads_;
  ThreadPool& pool_;  // of threads_
  std::unique_ptr<TraversalRun> traversal_;
  std::vector<std::unique_ptr<Worker>> workers_;
  std::vector<NarrowPhase*> narrow_phases_;  // of the workers

  const Mesh* mesh_ = nullptr;
  ListState list_state_ = ListState::off;
  std::int64_t last_candidates_ = min_candidates_for_threads;  // number in the last step
  double scale_ = 1;      // power of two of this step: see scale_for()
  double tolerance_ = 0;  // of the positions at the end of the step, in their unit
  std::vector<VertexRecord> records_;
  Hierarchy hierarchy_;
  std::unique_ptr<ExcludedPairs> excluded_;  // null: none
  std::unique_ptr<ContactSort> sort_;
  std::vector<Contact> contacts_, rechecked_;
  std::vector<ContactPart> parts_;      // scratch memory: the contacts of each worker
  std::vector<double> near_distances_;  // by body, of the last detection
  double nearest_ = 0;                  // lower bound of the distance of its near pairs, unscaled

  std::function<void(int)> ahead_job_;     // job of the worker that detects ahead
  bool is_running_ahead_ = false;          // the job is submitted and not joined
  bool has_ahead_result_ = false;          // a worker ran the job, and its result was not used yet
  std::vector<VertexRecord> last_motion_;  // of the detection before the motion in records_
  bool last_motion_is_kept_ = false;       // false: that of the last detection is in records_
  RelativeMotionBounds deviation_;         // of a re-check from the motion of the last detection
  bool is_rechecking_ = false;             // between stays_near_motion() and the end of a re-check

  // detect_ahead() overwrote the near pairs of the last detection, an exception ended it, other
  // bodies rest now, or another backend has them.
  bool near_pairs_lost_ = false;
  bool near_pairs_are_taken_ = false;  // from another backend, which knows the motion
  std::atomic<bool> is_interrupted_{false};
  bool are_sorted_ = false;  // contacts_ holds the contacts found ahead, sorted
  Stats ahead_stats_;
  std::vector<Contact> late_contacts_;  // contacts found later, to be merged into contacts_
  std::vector<NodePair> unexpanded_;    // pairs of nodes not visited because of the interruption

  std::vector<NodePair> front_;
  FrontPolicy front_policy_;
  VerletList verlet_list_;
};

}  // namespace lazyccd
