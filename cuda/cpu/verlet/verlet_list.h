// Verlet list: candidates for a minimum separation that stay valid for several steps (Verlet 1967,
// "Computer experiments on classical fluids").
//
// The list is built with a skin: boxes are wider than a step needs. For a pair of groups it holds
// every candidate that can come within the separation. That is so while no two of their points move
// apart or together by more than twice the skin. A step tests only the listed candidates whose
// distance was small enough, given the relative motion of the two groups up to now. Pairs of groups
// that have moved more are traversed again.
//
// Pairs of groups that move so fast that their candidates would not serve several steps are not
// listed. Each step traverses them, while the list goes on to serve the others.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/bvh/node_pair.h"
#include "core/narrow/contact_math.h"
#include "cpu/verlet/leaf_map.h"
#include "cpu/verlet/relative_motion.h"
#include "host/kernels/leaf_kernels.h"

namespace lazyccd {

class VerletList;

/// The part of the list that one worker fills: candidates, each with its pair of groups.
class alignas(128) ListedPairs {
 public:
  std::vector<ListedCandidate> of[2];  // by ContactKind
  std::vector<NodePair> pairs;         // pairs of leaves
  // By pair of leaves: upper bound on ListedCandidate::min_distance for candidates to test in this
  // step; scaled. Negative: none, because the traversal visits the pair again or it is skipped.
  std::vector<float> distance_limit;

  void clear();
  /// Adds a candidate, unless the list does not hold its pair of groups.
  void add(ContactKind kind, Candidate candidate, float min_distance, const VerletList& list);
  std::size_t size() const { return of[0].size() + of[1].size(); }
  std::size_t bytes() const;

 private:
  // Small hash table with the index of pairs added lately. Candidates of one pair of leaves usually
  // follow each other.
  std::array<std::uint32_t, 256> latest_{};
};

/// The list of all workers, and the decision when to build it, use it, and discard it.
class VerletList {
 public:
  VerletList(double separation, int workers)
      : separation_(separation), skin_(separation / 2), parts_(workers) {}

  /// Additional margin of the boxes, on every side, in the step that builds a list. Unscaled.
  double skin() const { return skin_; }
  /// Prepares for a new tree and discards the list. Call it whenever the tree has been rebuilt.
  void set_tree(const Mesh& mesh, const Groups& groups, const Tree& tree, ThreadPool& pool);
  void forget() { has_list_ = worthwhile_ = false; }
  /// The leaves of the tree of set_tree().
  const LeafMap& leaves() const { return leaves_; }

  /// Whether a list was built and not discarded since.
  bool has_list() const { return has_list_; }
  /// Whether a new list would probably stay valid for several steps, for enough pairs of groups.
  bool is_worthwhile(double scale) const;

  /// With a list: measures the motion since it was built, for covers() and measure_distances(). At
  /// the end of the step every vertex may be up to `tolerance` (unscaled) from its position in
  /// `records`.
  void begin_step(const std::vector<VertexRecord>& records, double tolerance, const Tree& tree,
                  ThreadPool& pool);
  /// Measures the motion since the last step, for would_list(). Call it in a step that traverses.
  /// The ends do not count: what pushes nodes together in each step moves nothing for long.
  void measure_step(const std::vector<VertexRecord>& last, const std::vector<VertexRecord>& records,
                    double scale, const Tree& tree, ThreadPool& pool);
  /// Whether the list has all candidates below a pair of nodes that can come within the separation
  /// in this step.
  bool covers(NodePair nodes) const {
    return motion_.difference_squared(nodes) <= limit_squared_ &&
           built_step_.difference_squared(nodes) <= built_limit_squared_;
  }
  /// Whether a list built in this step would hold the candidates below a pair of nodes: they move
  /// so slowly that the list would serve several steps.
  bool would_list(NodePair nodes) const {
    return step_.difference_squared(nodes) <= step_limit_squared_;
  }

  /// Starts to build a list in this step, after measure_step(): workers add candidates to their
  /// parts. finish_building() ends it; `visited` is the number of pairs of groups visited.
  void begin_building(const std::vector<VertexRecord>& records, double scale);
  void finish_building(std::int64_t visited, std::int64_t candidates);
  /// Largest distance at the start of the step of candidates that belong in the list, scaled.
  float listing_distance() const { return distance_limit(2 * skin_ * scale_); }

  ListedPairs& part(int worker) { return parts_[static_cast<std::size_t>(worker)]; }
  const std::vector<ListedPairs>& parts() const { return parts_; }
  std::size_t size() const;  ///< number of candidates
  /// Computes ListedPairs::distance_limit. Call it in a step with a list, after begin_step().
  /// is_skipped(NodePair): whether the candidates of a pair of leaves are not tested in this step.
  template <class IsSkipped>
  void measure_distances(IsSkipped&& is_skipped);

  /// Call it at the end of a step with a list: the numbers of pairs of groups that were visited and
  /// of candidates that were tested. Discards the list when it no longer pays.
  void record_use(std::int64_t visited, std::int64_t candidates);
  /// Call it at the end of a step without a list. `may_serve`: a list would hold enough of what was
  /// visited.
  void record_probe(std::int64_t visited, std::int64_t candidates, bool may_serve);

  std::size_t bytes() const;

 private:
  // A pair of groups is listed if so many steps like its last one stay within twice the skin. The
  // list itself may be discarded sooner.
  static constexpr double min_steps = 4;
  // To visit a pair of groups takes as long as to test so many candidates, and to test one as long
  // as to look at so many in the list. Measured: 0.8 us, 48 ns, 4 ns (AVX-512, a core of a Xeon).
  static constexpr std::int64_t visit_cost = 16, listed_per_candidate = 12;
  // After lists that did not pay, the next one is tried after a pause, which doubles each time, up
  // to so many steps.
  static constexpr int max_pause = 64;

  static std::int64_t cost_of(std::int64_t visited, std::int64_t candidates) {
    return visit_cost * visited + candidates;
  }

  float distance_limit(double relative_motion) const;

  double separation_, skin_;
  bool has_list_ = false, worthwhile_ = false;
  double scale_ = 1;  // of the step that built the list
  // Of the largest valid relative motion since the list was built, scaled; negative: none.
  double limit_squared_ = 0;
  // Of the largest relative motion since the last step for which a pair of groups is listed,
  // scaled: in the step that built the list, and in this step.
  double built_limit_squared_ = 0, step_limit_squared_ = 0;
  double tolerance_ = 0;   // additional relative motion of two points, scaled: see begin_step()
  std::int64_t cost_ = 0;  // of the step that built the list and of all since
  std::int64_t cost_without_ = 0;  // of the last step without a list
  int steps_ = 0;                  // number of steps that used the list
  int pause_ = 1, steps_to_wait_ = 0;
  LeafMap leaves_;
  std::vector<VertexRecord> origin_;        // start of the step that built the list, twice
  RelativeMotionBounds motion_;             // from the origin to this step
  RelativeMotionBounds step_, built_step_;  // since the last step: now, and when it was built
  std::vector<ListedPairs> parts_;          // by worker
};

template <class IsSkipped>
void VerletList::measure_distances(IsSkipped&& is_skipped) {
  for (ListedPairs& part : parts_) {
    part.distance_limit.resize(part.pairs.size());
    for (std::size_t i = 0; i < part.pairs.size(); ++i) {
      const double squared = motion_.difference_squared(part.pairs[i]);
      part.distance_limit[i] = squared <= limit_squared_ && !is_skipped(part.pairs[i])
                                   ? distance_limit(std::sqrt(squared) + tolerance_)
                                   : -1;
    }
  }
}

}  // namespace lazyccd
