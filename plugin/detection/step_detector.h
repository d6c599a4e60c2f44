// Finds the contacts of a step, and keeps those on which the response acts.
#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "contact/contact_cache.h"
#include "contact/contact_renumbering.h"
#include "contact/pair_surfaces.h"
#include "detection/motion_prediction.h"
#include "detection/near_contact_selector.h"
#include "filter/contact_filter.h"
#include "lazyccd/bullet/report.h"
#include "lazyccd/debug/assert.h"
#include "lazyccd/detector.h"
#include "motion/motion.h"
#include "obstacles/internal_edges.h"
#include "obstacles/simple_contacts.h"
#include "scene/step_topology.h"
#include "settings.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class StepDetector {
 public:
  /// Copies the options, without `separation` and `reduce_contacts`: this class sets both. Keeps
  /// references to the other arguments, which must outlive it.
  StepDetector(const DetectorOptions& options, const Threads& threads, ContactFilter& filter,
               const StepTopology& topology, Motion& motion, PairSurfaces& surfaces,
               double position_correction, bool contact_cache);

  /// Measures edges; sets Motion::shortest_edge, separation() and the limits of the surfaces. Call
  /// before each set_topology(), with the same arguments. `largest_thickness`: the largest
  /// thickness of any pair, metres.
  void set_lengths(double largest_thickness, const Renumbering& numbers,
                   const std::vector<std::int32_t>& changed_bodies);
  /// Call when indices or pair rules change. What is known about bodies that did not change is
  /// kept. `numbers`: where bodies and vertices of the last topology are now. `changed_bodies`:
  /// those that are new, changed or placed elsewhere. Throws lazyccd::Error if the detector refuses
  /// the topology.
  void set_topology(const Renumbering& numbers, const std::vector<std::int32_t>& changed_bodies);
  /// True if a new largest thickness needs another set_topology().
  bool would_change(double largest_thickness) const {
    return separation_for(largest_thickness) != separation_;
  }
  /// All edges of the topology, as Detector::edges(). Needs a set_topology() before.
  Span<const Edge> edges() const { return first_detector()->edges(); }

  /// Starts the first detection of the next step on another thread. Call after end_step().
  void detect_ahead();
  /// Marks the motion as new: no contacts are known in it yet.
  void begin_motion();
  /// Runs the first detection of a motion. Returns the pairs that come near each other: within
  /// settings::detection::distance_factor times the thickness. Pairs that are redundant, that
  /// need no constraint, or on which the response does not act are not selected: they have can_act
  /// = false. Valid until the next detect_near(), detect_ahead() or set_topology().
  /// `last_impulses` get new indices if they need them; their pairs are then preferred.
  NearContacts detect_near(LastImpulses& last_impulses);
  /// Call in place of detect_near() if no two bodies come within separation() of each other.
  /// Forgets what was kept of the last step.
  void forget_near() {
    selector_.forget();
    prediction_.forget();
    cache_.forget();
    note_seen_end();
  }
  double separation() const { return std::max(0.0, separation_); }  // metres
  /// True if the response acts on any pair that the last detect_near() found.
  bool found_any() const { return found_any_; }
  /// Returns the pairs that touch in the motion from `start` to `end` and on which the response
  /// acts, also those of bodies at rest.
  std::vector<Contact> touching(const Positions& start, const Positions& end);
  /// Returns all pairs that touch in any motion of the step's vertices, also those on which the
  /// response does not act. Valid until the next detection.
  Span<const Contact> touching_in(const Positions& start, const Positions& end) {
    return touching_detector().detect(start, end);
  }
  /// Finds the contacts that report_only_contacts() returns. Call when the motion is final.
  void find_report_only_contacts();
  /// Pairs that touch in the motion and on which the response does not act.
  const std::vector<Contact>& report_only_contacts() const { return report_only_contacts_; }
  /// Number of report_only_contacts() pairs of a kinematic body and pinned nodes that began to
  /// touch in this motion.
  std::int64_t count_passed_over() const;

  /// Ends the step. Call with the motion as it will be written to Bullet.
  void end_step(bool responded);
  /// Adds the counts and times of the last motion to `stats`.
  void add_to(StepStats& stats) const { stats += counts_; }
  std::string status() const {
    return first_detector() ? first_detector()->status() : "no detection yet";
  }

 private:
  /// For assertions: notes that no contact passes unseen until the present end of the motion.
  void note_seen_end() {
    if constexpr (checks_assertions) seen_end_ = motion_.end;
  }
  /// True if `end` is the start of the motion: the motion then is from start to start, and only
  /// pairs that touch at the start are contacts.
  bool is_start_of_motion(const Positions& end) const {
    return end.data() == motion_.start().data();
  }
  /// True if `end` is the end of the motion, as it is now.
  bool is_end_of_motion(const Positions& end) const { return end.data() == motion_.end.data(); }
  bool only_near_can_touch(const Positions& end) const;
  /// Gives near_detector_ the topology without the pairs of simple_contacts_.
  void set_near_topology();
  /// Marks bodies that are not those of `numbers`, or collide with others than before.
  void mark_other_rules(const Renumbering& numbers, const std::vector<Body>& last_filters,
                        const std::vector<BodyPair>& last_disabled,
                        std::vector<char>& is_changed) const;
  /// For HiddenContacts: they collide, and at most one of them is rigid. Rigid bodies may be
  /// joined, and LazyCCD does not handle their contacts. The surface of one body counts as a whole.
  bool stop_each_other(std::int32_t a, std::int32_t b) const;
  /// True if near_detector_ leaves out internal edges.
  bool leaves_out_any() const { return !internal_edges_.edges_left_out().empty(); }
  /// True if two bodies may collide that simple_contacts_ does not handle.
  bool find_others_may_meet(Span<const Body> filters) const;
  /// Finds what is near and needs a constraint with near_detector_, or keeps that of an earlier
  /// step.
  Span<const Contact> find_near_with_detector();
  void find_self_distances(Span<const Body> filters);
  Span<const double> found_distances();  ///< for the ContactCache
  /// Returns the pairs that touch in the motion from `start` to `end`. Pairs that the first
  /// detection did not report must be known not to touch.
  Span<const Contact> recheck(const Positions& start, const Positions& end);
  /// Edges of a body are measured when it is new or changed, so that what limits its gaps stays.
  void measure_edges(const Topology& topology, const Renumbering& numbers,
                     const std::vector<char>& is_changed);
  std::vector<char> marks_of(const std::vector<std::int32_t>& bodies) const;  ///< by body
  double separation_for(double largest_thickness) const;
  /// By body: the largest thickness of its pairs for which contacts are looked for, metres. It is
  /// a multiple of the body's own edges, and at most of those of all bodies.
  std::vector<double> thickness_limits() const;
  /// The largest thickness of a pair whose contacts are all found, metres.
  double largest_thickness() const { return separation_ / settings::detection::distance_factor; }
  /// Created and given the topology when it is first needed: most steps need near_detector_ alone.
  Detector& touching_detector();
  /// The detector of the first detection in a step; null before the first topology.
  Detector* first_detector() const {
    return near_detector_ ? near_detector_.get() : touching_detector_.get();
  }
  /// Returns the contacts on which the response acts.
  std::vector<Contact> keep_acting(Span<const Contact> contacts) const;
  /// Sets report_only_contacts_ to those of `contacts` that are only reported.
  void record_report_only(Span<const Contact> contacts);

  DetectorOptions options_;
  Threads threads_;
  ContactFilter& filter_;
  const StepTopology& topology_;
  Motion& motion_;
  PairSurfaces& surfaces_;
  NearContactSelector selector_;
  SimpleContacts simple_contacts_;
  InternalEdges internal_edges_;
  bool others_may_meet_ = true;              ///< pairs that simple_contacts_ does not handle
  std::vector<Contact> near_simple_, near_;  ///< near contacts of simple_contacts_, all of the step
  std::vector<Contact> constrained_;  ///< near contacts of the detector that need a constraint
  /// Finds contacts without separation; null until it is needed.
  std::unique_ptr<Detector> touching_detector_;
  bool touching_topology_is_current_ = false;
  /// Declared before near_detector_, because a thread of that detector reads its positions.
  MotionPrediction prediction_;
  /// Finds pairs within a thickness; null if no thickness is positive.
  std::unique_ptr<Detector> near_detector_;
  double separation_ = 0;  ///< separation of near_detector_, metres; not positive without it
  double common_median_edge_ = 0;       ///< of all: one distance is searched for all pairs
  std::vector<float> self_separation_;  ///< for Topology
  // What set_near_topology() set:
  PrimitiveIndices primitives_;
  std::vector<Body> filters_;             ///< of near_detector_
  std::vector<Body> rules_;               ///< the same with the pairs of simple_contacts_
  std::vector<BodyPair> disabled_pairs_;  ///< the smaller index first, sorted
  /// Found by the first detection if there is no near_detector_.
  std::vector<Contact> touching_pairs_;
  std::vector<Contact> report_only_contacts_;
  bool report_only_is_known_ = true;  ///< report_only_contacts_ is valid for the current motion
  bool found_any_ = false;
  bool may_keep_near_;       ///< SolverOptions::contact_cache
  ContactCache cache_;       ///< of what near_detector_ finds
  bool keeps_near_ = false;  ///< in this motion, so near_detector_ was not asked
  bool keeps_some_ = false;  ///< so it left out the pairs of bodies that stay
  /// Other bodies stay than in the last detection, so one that is started ahead would be discarded.
  bool rest_changed_ = false;
  /// By body, metres: pairs of its own primitives within this distance are found, if it meets
  /// itself; else the separation.
  std::vector<double> self_distances_;
  std::vector<double> found_distances_;  ///< scratch memory
  std::vector<btScalar> seen_end_;       ///< of note_seen_end(); empty without assertions
  bool any_near_ = false;                ///< anything is near that near_detector_ knows
  bool detected_near_ = false;           ///< detect_near() used near_detector_ in this step
  bool detected_near_last_ = false;      ///< and in the last step
  StepStats counts_;                     ///< counts and times of the detections of the motion
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
