// Verlet list: candidates for a minimum separation that stay valid for several steps (Verlet 1967,
// "Computer experiments on classical fluids").
//
// The list is built with a skin: boxes are wider than a step needs. For a pair of groups it holds
// every candidate that can come within the separation, while no two of their points move apart or
// together by more than twice the skin. A step tests only the listed candidates whose distance was
// small enough, given the relative motion of the two groups up to now. Pairs of groups that have
// moved more are traversed again.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/bvh/node_pair.h"
#include "core/narrow/contact_math.h"
#include "cpu/kernels/leaf_kernels.h"
#include "cpu/verlet/relative_motion.h"

namespace lazyccd {

/// The part of the list that one worker fills: candidates, each with its pair of groups.
class alignas(128) ListedPairs {
 public:
  std::vector<ListedCandidate> of[2];  // by ContactKind
  std::vector<NodePair> pairs;         // pairs of leaves
  // By pair of leaves: upper bound on ListedCandidate::min_distance for candidates to test in this
  // step; scaled. Negative: the traversal visits the pair again.
  std::vector<float> distance_limit;

  void clear();
  void add(ContactKind kind, Candidate candidate, float min_distance,
           const RelativeMotionBounds& motion);
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

  /// Whether a list was built and not discarded since.
  bool has_list() const { return has_list_; }
  /// Whether a new list would probably stay valid for several steps, for most pairs of groups.
  bool is_worthwhile(double scale) const;

  /// Measures the motion at the start of a step, for the tree of set_tree(). With a list: the
  /// motion since the list was built, for covers() and measure_distances(). Without: the motion in
  /// this step, for would_stay_valid(). At the end of the step every vertex may be up to
  /// `tolerance` (unscaled) from its position in `records`.
  void begin_step(const std::vector<VertexRecord>& records, double scale, double tolerance,
                  const Tree& tree, ThreadPool& pool);
  /// Whether the list has all candidates below a pair of nodes that can come within the separation
  /// in this step.
  bool covers(NodePair nodes) const { return moves_within(nodes, limit_squared_); }
  /// Whether a list built now would stay valid for several steps below a pair of nodes.
  bool would_stay_valid(NodePair nodes) const {
    return moves_within(nodes, limit_squared_ / (min_steps * min_steps));
  }

  /// Starts to build a list in this step: workers add candidates to their parts.
  /// finish_building() ends it.
  void begin_building(const std::vector<VertexRecord>& records, double scale);
  void finish_building();
  /// Largest distance at the start of the step of candidates that belong in the list, scaled.
  float listing_distance() const { return distance_limit(2 * skin_ * motion_.scale()); }
  const RelativeMotionBounds& motion() const { return motion_; }

  ListedPairs& part(int worker) { return parts_[static_cast<std::size_t>(worker)]; }
  const std::vector<ListedPairs>& parts() const { return parts_; }
  std::size_t size() const;  ///< number of candidates
  /// Computes ListedPairs::distance_limit. Call it in a step with a list, after begin_step().
  void measure_distances();

  /// Call it at the end of a step with a list. `candidates` is the number of candidates that did
  /// not come from the list. Discards the list if that number has become too large.
  void record_use(std::int64_t candidates);
  /// Call it at the end of a step without a list. `pairs` is the number of pairs of groups visited,
  /// and `lasting` the number of those for which would_stay_valid() holds.
  void record_probe(std::int64_t pairs, std::int64_t lasting) { worthwhile_ = 2 * lasting > pairs; }

  std::size_t bytes() const;

 private:
  // Number of steps that a list must last. A step that builds a list costs more than a step
  // without.
  static constexpr double min_steps = 4;

  bool moves_within(NodePair nodes, double squared) const {
    return motion_.difference_squared(nodes.a, nodes.b) <= squared;
  }
  float distance_limit(double relative_motion) const;

  double separation_, skin_;
  bool has_list_ = false, worthwhile_ = false;
  double limit_squared_ = 0;   // of the largest valid relative motion, scaled; negative: none
  double tolerance_ = 0;       // additional relative motion of two points, scaled: see begin_step()
  std::int64_t searched_ = 0;  // candidates that did not come from the list, since it was built
  int steps_ = 0;              // number of steps that used the list
  RelativeMotionBounds motion_;
  std::vector<ListedPairs> parts_;  // by worker
};

}  // namespace lazyccd
