// Finds the contacts of a step that the response is to answer.
#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "response/contact_constraints.h"
#include "detection/motion_prediction.h"
#include "lazyccd/bullet/report.h"
#include "lazyccd/detector.h"
#include "motion/motion.h"
#include "detection/speculative_contacts.h"
#include "scene/soft_scene.h"
#include "scene/step_topology.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class StepDetector {
 public:
  // What it reads of a step must outlive it.
  StepDetector(const lazyccd::Options& options, const SoftScene& scene,
               const StepTopology& topology, Motion& motion, ContactRows::Surface surface,
               double recovery);

  // To be called where indices or pair rules change, with the largest thickness of any pair,
  // metres. Sets the motion's reach. Throws lazyccd::Error for a topology that it does not take.
  void set_topology(double largest_thickness);
  // Whether another largest thickness asks for that too.
  bool would_change(double largest_thickness) const {
    return separation_for(largest_thickness) != separation_;
  }
  Span<const Edge> edges() const { return first()->edges(); }

  // To be called after end_step(): the next step's first detection may begin.
  void foresee();
  // Takes the motion for a new one: nothing is found in it yet.
  void begin_motion();
  // The first detection of a motion: pairs that come within their thickness of each other, of which
  // those that say nothing new do not give way. Valid until the next one, foresee() or
  // set_topology().
  NearProspects near();
  // In place of that, where nothing comes within separation() of anything.
  void forget_near() {
    near_contacts_.forget();
    foresight_.forget();
  }
  double separation() const { return std::max(0.0, separation_); }  // metres
  // Whether that one found anything that may be answered.
  bool found_any() const { return found_any_; }
  // Pairs that touch in the motion from `start` to `end`.
  std::vector<Contact> touching(const Positions& start, const Positions& end);
  // To be called once the motion is what it will be: finds what is silent().
  void find_silent();
  // Pairs that touch in the motion and about which nothing may be done.
  const std::vector<Contact>& silent() const { return silent_; }
  // Of these, pairs of a kinematic body and pinned nodes that it came upon in this motion.
  std::int64_t count_passed_over() const;

  // An anchor holds a node of the one to the other's rigid body.
  bool are_anchored(const Edge& edge, const Face& face) const {
    const std::array<std::int32_t, 5> vertices = {edge[0], edge[1], face[0], face[1], face[2]};
    return are_anchored(topology_.body_of(edge[0]), topology_.body_of(face[0]),
                        {vertices.data(), vertices.size()});
  }

  // As Detector::parallel_for(); before the first topology on the caller's thread.
  void parallel_for(std::size_t count, std::size_t grain,
                    const std::function<void(std::size_t first, std::size_t last)>& body);

  // To be called with the step's motion as it will be written.
  void end_step(bool responded);
  // Of the last motion: adds what it cost.
  void add_to(StepStats& stats) const;
  std::string status() const { return first() ? first()->status() : "no step yet"; }

 private:
  bool are_anchored(std::int32_t body_a, std::int32_t body_b,
                    Span<const std::int32_t> vertices) const;
  bool is_anchored(const Contact& contact) const {
    return are_anchored(contact.body_a, contact.body_b,
                        {contact.vertices.data(), contact.vertices.size()});
  }
  bool responds(const Contact& contact) const;
  // Pinned nodes that are driven stop before what they would pass through. A kinematic body passes
  // over pinned nodes, unless something of the pair has been stopped.
  bool may_be_ended(const Contact& contact) const;
  // The same of the motion as Bullet had it.
  bool could_be_ended(const Contact& contact) const;
  bool gives_way(std::int32_t vertex) const;
  bool only_near_can_touch(const Positions& end) const;
  void read_reach(const Topology& topology);
  double separation_for(double largest_thickness) const;
  // Made and told of the topology where it is first needed: most steps need near_ alone.
  Detector& touching_detector();
  // The one of a step's first detection; null before the first topology.
  Detector* first() const { return near_ ? near_.get() : touching_.get(); }
  enum class Answer : std::uint8_t { given, none, not_asked };
  Answer answer_to(const Contact& contact) const;
  // Those that get an answer; those that cannot are silent.
  std::vector<Contact> answerable(Span<const Contact> contacts);

  lazyccd::Options options_;
  const SoftScene& scene_;
  const StepTopology& topology_;
  Motion& motion_;
  NearContacts near_contacts_;
  std::unique_ptr<Detector> touching_;  // null until it is needed
  bool touching_is_current_ = false;
  Foresight foresight_;             // before near_, of which a thread reads its positions
  std::unique_ptr<Detector> near_;  // of what comes within a thickness; null without any
  double separation_ = 0;           // of near_, metres; not positive without it
  double usual_reach_ = 0;          // metres: the median of Motion::reach
  std::vector<float> self_reach_;   // of Topology
  std::vector<Contact> touched_;    // by the first detection, without near_
  std::vector<Contact> silent_;
  bool silent_is_known_ = true;  // for the motion as it is
  bool found_any_ = false;
  bool looked_near_ = false;  // in this step
  std::int64_t detections_ = 0;
  std::int64_t foreseen_ = 0;
  double ms_ = 0;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
