#include "detection/step_detector.h"

#include <algorithm>
#include <limits>

#include "util/stopwatch.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

StepDetector::StepDetector(const DetectorOptions& options, const Threads& threads,
                           ContactFilter& filter, const StepTopology& topology, Motion& motion,
                           const PairSurfaces& surfaces, double position_correction)
    : options_(options),
      threads_(threads),
      filter_(filter),
      topology_(topology),
      motion_(motion),
      speculative_(surfaces, position_correction) {}

void StepDetector::set_topology(double largest_thickness) {
  speculative_.forget();
  prediction_.forget();
  Topology topology = topology_.for_detection();
  touching_is_current_ = false;
  read_reach(topology);
  topology.self_separation = self_separation_;
  const double separation = separation_for(largest_thickness);
  if (!(separation > 0)) {
    near_.reset();
    touching_detector();
  } else {
    if (!near_ || separation_ != separation) {
      DetectorOptions options = options_;
      options.separation = separation;
      options.reduce_contacts = true;
      near_ = std::make_unique<Detector>(options, threads_);
    }
    near_->set_topology(topology);
  }
  separation_ = separation;
}

// Neighbours in a mesh are not to be near each other by themselves.
double StepDetector::separation_for(double largest_thickness) const {
  return std::min(SpeculativeContacts::reach * largest_thickness, 0.5 * usual_reach_);
}

void StepDetector::read_reach(const Topology& topology) {
  motion_.shortest_edge.assign(motion_.inverse_mass.size(), std::numeric_limits<double>::infinity());
  const auto read_edge = [this](std::int32_t a, std::int32_t b) {
    if (!topology_.is_soft(a)) return;
    const double length = (motion_.start_of(a) - motion_.start_of(b)).norm();
    for (const std::int32_t v : {a, b}) motion_.shortest_edge[v] = std::min(motion_.shortest_edge[v], length);
  };
  for (const Edge& edge : topology.edges) read_edge(edge[0], edge[1]);
  for (const Face& face : topology.faces) {
    for (int k = 0; k < 3; ++k) read_edge(face[k], face[(k + 1) % 3]);
  }
  std::vector<double> reach = motion_.shortest_edge;
  const auto middle = reach.begin() + static_cast<std::ptrdiff_t>(reach.size() / 2);
  std::nth_element(reach.begin(), middle, reach.end());
  usual_reach_ = *middle;
  self_separation_.assign(topology.vertex_count, std::numeric_limits<float>::infinity());
  for (std::int32_t v = 0; v < motion_.soft_count(); ++v)
    self_separation_[v] = SpeculativeContacts::self_separation(v, motion_);
}

Detector& StepDetector::touching_detector() {
  if (!touching_) touching_ = std::make_unique<Detector>(options_, threads_);
  if (!touching_is_current_) touching_->set_topology(topology_.for_detection());
  touching_is_current_ = true;
  return *touching_;
}

void StepDetector::detect_ahead() {
  if (near_) prediction_.announce(*near_, separation_);
}

void StepDetector::end_step(bool responded) {
  if (near_ && looked_near_) prediction_.remember(motion_, responded);
}

void StepDetector::begin_motion() {
  unanswered_.clear();
  unanswered_is_known_ = true;
  found_any_ = false;
  filter_.begin_motion();
  detections_ = started_ahead_ = 0;
  looked_near_ = false;
  ms_ = 0;
}

void StepDetector::add_to(StepStats& stats) const {
  stats.detections += detections_;
  stats.started_ahead += started_ahead_;
  stats.ms_detect += ms_;
}

std::vector<Contact> StepDetector::touching(const Positions& start, const Positions& end) {
  const Stopwatch watch;
  std::vector<Contact> contacts =
      answerable(only_near_can_touch(end) ? near_->recheck_near_pairs(start, end)
                                          : touching_detector().detect(start, end));
  unanswered_is_known_ = contacts.empty() && end.data() == motion_.end.data();
  ms_ += watch.ms();
  return contacts;
}

// What did not come near in the first detection stayed further apart than the separation, all the
// time. So it cannot touch while no two vertices that may meet leave that motion by as much
// together; nor where the step begins.
bool StepDetector::only_near_can_touch(const Positions& end) const {
  return near_ && (end.data() == motion_.start.data() ||
                   motion_.largest_deviation_sum(topology_.topology().bodies) <= 0.998 * separation_);
}

SpeculativePairs StepDetector::near() {
  if (!near_) {
    touched_ = touching(motion_.starts(), motion_.ends());
    found_any_ = !touched_.empty();
    filter_.set_answered(found_any_);
    return speculative_.all(touched_, motion_);
  }
  const Stopwatch watch;
  const Span<const Contact> near = near_->detect(motion_.starts(), motion_.ends());
  looked_near_ = true;
  ++detections_;
  const Stats& stats = near_->stats();
  started_ahead_ += stats.started_ahead;
  prediction_.compare(motion_, stats.candidates_vf + stats.candidates_ee);
  const bool any_near = stats.near > 0;
  const SpeculativePairs chosen = speculative_.choose(near, filter_, motion_, threads_);
  // Where nothing may be done about what is reported, something may about what is near and not: the
  // pair that stands for others lacks a vertex that they have, or has one that is anchored.
  found_any_ =
      speculative_.any_answered() ||
      (any_near && !answerable(near_->recheck_near_pairs(motion_.starts(), motion_.ends())).empty());
  filter_.set_answered(found_any_);
  unanswered_is_known_ = !found_any_;
  ms_ += watch.ms();
  return chosen;
}

std::vector<Contact> StepDetector::answerable(Span<const Contact> contacts) {
  const bool may_be_told = near_ || detections_ == 0;
  if (may_be_told) unanswered_.clear();
  std::vector<Contact> answered;
  for (const Contact& contact : contacts) {
    const ContactFilter::Answer answer = filter_.answer_to(contact);
    if (answer == ContactFilter::Answer::given) {
      answered.push_back(contact);
    } else if (answer == ContactFilter::Answer::none && may_be_told) {
      unanswered_.push_back(contact);
    }
  }
  ++detections_;
  return answered;
}

void StepDetector::find_unanswered() {
  if (!near_ || unanswered_is_known_) return;
  unanswered_.clear();
  for (const Contact& contact : near_->recheck_near_pairs(motion_.starts(), motion_.ends())) {
    if (!filter_.is_anchored(contact) &&
        !(filter_.responds(contact) && filter_.could_be_ended(contact)))
      unanswered_.push_back(contact);
  }
}

std::int64_t StepDetector::count_passed_over() const {
  return std::count_if(unanswered_.begin(), unanswered_.end(), [this](const Contact& contact) {
    const bool moves =
        std::any_of(contact.vertices.begin(), contact.vertices.end(),
                    [this](std::int32_t v) { return motion_.end_of(v) != motion_.start_of(v); });
    return moves && contact.toi > 0 && filter_.responds(contact);
  });
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
