// Candidates for a minimum separation that outlast a step (Verlet 1967, "Computer experiments on
// classical fluids"): sought with a little more room than need be, they are all that can come that
// near in a pair of groups until its points have moved differently by all of it. Of these, a step
// tests those that can come that near for as little as the two groups have moved up to now; in
// pairs of groups that have moved more it seeks anew.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/contact_math.h"
#include "core/node_pair.h"
#include "cpu/verlet/relative_motion.h"
#include "cpu/narrow/leaf_kernels.h"

namespace lazyccd {

// The candidates that one worker lists, each with its pair of groups.
class alignas(128) ListedPairs {
 public:
  std::vector<ListedCandidate> of[2];  // by ContactKind
  std::vector<NodePair> pairs;         // of leaves
  // By pair: how far apart what comes near in this step can have been where the list was made;
  // negative where the pair is sought anew.
  std::vector<float> distance_limit;

  void clear();
  void add(ContactKind kind, Candidate candidate, float apart, const RelativeMotionBounds& groups);
  std::size_t size() const { return of[0].size() + of[1].size(); }
  std::size_t bytes() const;

 private:
  // Where pairs stand that were added lately: candidates of one come one after the other.
  std::array<std::uint32_t, 256> latest_{};
};

class VerletList {
 public:
  VerletList(double separation, int workers)
      : separation_(separation), skin_(separation / 2), parts_(workers) {}

  // By how much further than a step needs boxes have to grow on every side for a list.
  double skin() const { return skin_; }
  // To be called for another tree. There is no list then.
  void build(const Mesh& mesh, const Groups& groups, const Tree& tree);
  void forget() { made_ = worthwhile_ = false; }

  bool made() const { return made_; }
  // Whether a list would serve most pairs of groups for some steps.
  bool is_worthwhile(double scale) const;

  // At the start of a step, of the tree as it was built. With a list: how far groups have moved
  // since it was made, for holds() and reach(). Without: how far they move in this step, for
  // would_stay_valid(). Where the step ends, vertices may lie up to `tolerance` from where they are said
  // to.
  void begin_step(const std::vector<VertexRecord>& records, double scale, double tolerance,
                  const Tree& tree, ThreadPool& pool);
  // Whether all that can come near in this step below a pair of nodes is listed.
  bool holds(NodePair nodes) const { return moves_within(nodes, limit_squared_); }
  // Whether a list that was made now would hold for some steps.
  bool would_stay_valid(NodePair nodes) const {
    return moves_within(nodes, limit_squared_ / (least_steps * least_steps));
  }

  // Takes this step for the one that a list is made in: workers add to their parts.
  void begin(const std::vector<VertexRecord>& records, double scale);
  void complete();
  // What to list: as far apart as what the list is to hold can be.
  float listing_distance() const { return reach(2 * skin_ * groups_.scale()); }
  const RelativeMotionBounds& groups() const { return groups_; }

  ListedPairs& part(int worker) { return parts_[static_cast<std::size_t>(worker)]; }
  const std::vector<ListedPairs>& parts() const { return parts_; }
  std::size_t size() const;  // candidates
  // To be called before ListedPairs::reach is read, in a step with a list.
  void measure_distances();

  // At the end of a step with a list, which made so many candidates besides; without: in which so
  // many pairs of groups were opened.
  void record_use(std::int64_t candidates);
  void record_probe(std::int64_t pairs, std::int64_t lasting) { worthwhile_ = 2 * lasting > pairs; }

  std::size_t bytes() const;

 private:
  // Steps that a list should last for, for it costs more to make than without.
  static constexpr double least_steps = 4;

  bool moves_within(NodePair nodes, double squared) const {
    return groups_.difference_squared(nodes.a, nodes.b) <= squared;
  }
  float reach(double difference) const;

  double separation_, skin_;
  bool made_ = false, worthwhile_ = false;
  double limit_squared_ = 0;  // negative: nothing moves so little
  double unknown_ = 0;        // scaled: that two points may move differently besides
  std::int64_t searched_ = 0;   // candidates besides, since the list was made
  int steps_ = 0;             // that it served
  RelativeMotionBounds groups_;
  std::vector<ListedPairs> parts_;  // by worker
};

}  // namespace lazyccd
