// Finds the contacts of a step that the response is to answer.
#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "contact/pair_surfaces.h"
#include "detection/contact_filter.h"
#include "detection/motion_prediction.h"
#include "lazyccd/bullet/report.h"
#include "lazyccd/detector.h"
#include "motion/motion.h"
#include "detection/speculative_contacts.h"
#include "scene/step_topology.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class StepDetector {
 public:
  // What it reads of a step must outlive it.
  StepDetector(const DetectorOptions& options, const Threads& threads, ContactFilter& filter,
               const StepTopology& topology, Motion& motion, const PairSurfaces& surfaces,
               double position_correction);

  // To be called where indices or pair rules change, with the largest thickness of any pair,
  // metres. Sets the motion's reach. Throws lazyccd::Error for a topology that it does not take.
  void set_topology(double largest_thickness);
  // Whether another largest thickness asks for that too.
  bool would_change(double largest_thickness) const {
    return separation_for(largest_thickness) != separation_;
  }
  Span<const Edge> edges() const { return first()->edges(); }

  // To be called after end_step(): the next step's first detection may begin.
  void detect_ahead();
  // Takes the motion for a new one: nothing is found in it yet.
  void begin_motion();
  // The first detection of a motion: pairs that come within their thickness of each other, of which
  // those that say nothing new do not give way. Valid until the next one, detect_ahead() or
  // set_topology().
  SpeculativePairs near();
  // In place of that, where nothing comes within separation() of anything.
  void forget_near() {
    speculative_.forget();
    prediction_.forget();
  }
  double separation() const { return std::max(0.0, separation_); }  // metres
  // Whether that one found anything that may be answered.
  bool found_any() const { return found_any_; }
  // Pairs that touch in the motion from `start` to `end`.
  std::vector<Contact> touching(const Positions& start, const Positions& end);
  // To be called once the motion is what it will be: finds what is silent().
  void find_unanswered();
  // Pairs that touch in the motion and about which nothing may be done.
  const std::vector<Contact>& unanswered() const { return unanswered_; }
  // Of these, pairs of a kinematic body and pinned nodes that it came upon in this motion.
  std::int64_t count_passed_over() const;

  // To be called with the step's motion as it will be written.
  void end_step(bool responded);
  // Of the last motion: adds what it cost.
  void add_to(StepStats& stats) const;
  std::string status() const { return first() ? first()->status() : "no step yet"; }

 private:
  bool only_near_can_touch(const Positions& end) const;
  void read_reach(const Topology& topology);
  double separation_for(double largest_thickness) const;
  // Made and told of the topology where it is first needed: most steps need near_ alone.
  Detector& touching_detector();
  // The one of a step's first detection; null before the first topology.
  Detector* first() const { return near_ ? near_.get() : touching_.get(); }
  // Those that get an answer; those that cannot are silent.
  std::vector<Contact> answerable(Span<const Contact> contacts);

  DetectorOptions options_;
  Threads threads_;
  ContactFilter& filter_;
  const StepTopology& topology_;
  Motion& motion_;
  SpeculativeContacts speculative_;
  std::unique_ptr<Detector> touching_;  // null until it is needed
  bool touching_is_current_ = false;
  MotionPrediction prediction_;             // before near_, of which a thread reads its positions
  std::unique_ptr<Detector> near_;  // of what comes within a thickness; null without any
  double separation_ = 0;           // of near_, metres; not positive without it
  double usual_reach_ = 0;          // metres: the median of Motion::reach
  std::vector<float> self_separation_;   // of Topology
  std::vector<Contact> touched_;    // by the first detection, without near_
  std::vector<Contact> unanswered_;
  bool unanswered_is_known_ = true;  // for the motion as it is
  bool found_any_ = false;
  bool looked_near_ = false;  // in this step
  std::int64_t detections_ = 0;
  std::int64_t started_ahead_ = 0;
  double ms_ = 0;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
