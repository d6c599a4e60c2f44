#include "detection/step_detector.h"

#include <algorithm>
#include <atomic>
#include <limits>

#include "util/stopwatch.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

StepDetector::StepDetector(const lazyccd::Options& options, const SoftScene& scene,
                           const StepTopology& topology, Motion& motion,
                           ContactRows::Surface surface, double recovery)
    : options_(options),
      scene_(scene),
      topology_(topology),
      motion_(motion),
      near_contacts_(std::move(surface), recovery) {}

void StepDetector::set_topology(double largest_thickness) {
  near_contacts_.forget();
  foresight_.forget();
  Topology topology = topology_.for_detection();
  touching_is_current_ = false;
  read_reach(topology);
  topology.self_reach = self_reach_;
  const double separation = separation_for(largest_thickness);
  if (!(separation > 0)) {
    near_.reset();
    touching_detector();
  } else {
    if (!near_ || separation_ != separation) {
      lazyccd::Options options = options_;
      options.separation = separation;
      options.distinct = true;
      near_ = std::make_unique<Detector>(options);
    }
    near_->set_topology(topology);
  }
  separation_ = separation;
}

// Neighbours in a mesh are not to be near each other by themselves.
double StepDetector::separation_for(double largest_thickness) const {
  return std::min(NearContacts::reach * largest_thickness, 0.5 * usual_reach_);
}

void StepDetector::read_reach(const Topology& topology) {
  motion_.reach.assign(motion_.inverse_mass.size(), std::numeric_limits<double>::infinity());
  const auto read_edge = [this](std::int32_t a, std::int32_t b) {
    if (!topology_.is_soft(a)) return;
    const double length = (motion_.start_of(a) - motion_.start_of(b)).norm();
    for (const std::int32_t v : {a, b}) motion_.reach[v] = std::min(motion_.reach[v], length);
  };
  for (const Edge& edge : topology.edges) read_edge(edge[0], edge[1]);
  for (const Face& face : topology.faces) {
    for (int k = 0; k < 3; ++k) read_edge(face[k], face[(k + 1) % 3]);
  }
  std::vector<double> reach = motion_.reach;
  const auto middle = reach.begin() + static_cast<std::ptrdiff_t>(reach.size() / 2);
  std::nth_element(reach.begin(), middle, reach.end());
  usual_reach_ = *middle;
  self_reach_.assign(topology.vertex_count, std::numeric_limits<float>::infinity());
  for (std::int32_t v = 0; v < motion_.soft_count(); ++v)
    self_reach_[v] = NearContacts::self_reach(v, motion_);
}

Detector& StepDetector::touching_detector() {
  if (!touching_) touching_ = std::make_unique<Detector>(options_);
  if (!touching_is_current_) touching_->set_topology(topology_.for_detection());
  touching_is_current_ = true;
  return *touching_;
}

void StepDetector::parallel_for(std::size_t count, std::size_t grain,
                                const std::function<void(std::size_t, std::size_t)>& body) {
  if (Detector* const detector = first()) {
    detector->parallel_for(count, grain, body);
  } else {
    body(0, count);
  }
}

void StepDetector::foresee() {
  if (near_) foresight_.announce(*near_, separation_);
}

void StepDetector::end_step(bool responded) {
  if (near_ && looked_near_) foresight_.remember(motion_, responded);
}

void StepDetector::begin_motion() {
  silent_.clear();
  silent_is_known_ = true;
  found_any_ = false;
  detections_ = foreseen_ = 0;
  looked_near_ = false;
  ms_ = 0;
}

void StepDetector::add_to(StepStats& stats) const {
  stats.detections += detections_;
  stats.foreseen += foreseen_;
  stats.ms_detect += ms_;
}

std::vector<Contact> StepDetector::touching(const Positions& start, const Positions& end) {
  const Stopwatch watch;
  std::vector<Contact> contacts =
      answerable(only_near_can_touch(end) ? near_->touching_again(start, end)
                                          : touching_detector().detect(start, end));
  silent_is_known_ = contacts.empty() && end.data() == motion_.end.data();
  ms_ += watch.ms();
  return contacts;
}

// What did not come near in the first detection stayed further apart than the separation, all the
// time. So it cannot touch while no two vertices that may meet leave that motion by as much
// together; nor where the step begins.
bool StepDetector::only_near_can_touch(const Positions& end) const {
  return near_ && (end.data() == motion_.start.data() ||
                   motion_.off_together(topology_.topology().bodies) <= 0.998 * separation_);
}

NearProspects StepDetector::near() {
  if (!near_) {
    touched_ = touching(motion_.starts(), motion_.ends());
    found_any_ = !touched_.empty();
    return near_contacts_.all(touched_, motion_);
  }
  const Stopwatch watch;
  const Span<const Contact> near = near_->detect(motion_.starts(), motion_.ends());
  looked_near_ = true;
  ++detections_;
  const Stats& stats = near_->stats();
  foreseen_ += stats.foreseen;
  foresight_.compare(motion_, stats.candidates_vf + stats.candidates_ee);
  const bool any_near = stats.near > 0;
  std::atomic<bool> any_answered{false};
  const auto is_answered = [&](const Contact& contact) {
    if (answer_to(contact) != Answer::given) return false;
    // Relaxed: read after the job's end. Looked at first, for it is every thread's.
    if (!any_answered.load(std::memory_order_relaxed))
      any_answered.store(true, std::memory_order_relaxed);
    return true;
  };
  const NearProspects chosen = near_contacts_.choose(
      near, is_answered, motion_, [this](std::size_t count, std::size_t grain, const auto& body) {
        parallel_for(count, grain, body);
      });
  // Where nothing may be done about what is reported, something may about what is near and not: the
  // pair that stands for others lacks a vertex that they have, or has one that is anchored.
  found_any_ =
      any_answered ||
      (any_near && !answerable(near_->touching_again(motion_.starts(), motion_.ends())).empty());
  silent_is_known_ = !found_any_;
  ms_ += watch.ms();
  return chosen;
}

StepDetector::Answer StepDetector::answer_to(const Contact& contact) const {
  if (is_anchored(contact)) return Answer::not_asked;
  return responds(contact) && may_be_ended(contact) ? Answer::given : Answer::none;
}

std::vector<Contact> StepDetector::answerable(Span<const Contact> contacts) {
  const bool may_be_told = near_ || detections_ == 0;
  if (may_be_told) silent_.clear();
  std::vector<Contact> answered;
  for (const Contact& contact : contacts) {
    const Answer answer = answer_to(contact);
    if (answer == Answer::given) {
      answered.push_back(contact);
    } else if (answer == Answer::none && may_be_told) {
      silent_.push_back(contact);
    }
  }
  ++detections_;
  return answered;
}

bool StepDetector::may_be_ended(const Contact& contact) const {
  const auto stopped = [this](std::int32_t v) {
    return found_any_ && motion_.end_of(v) != motion_.predicted[v];
  };
  return could_be_ended(contact) ||
         std::any_of(contact.vertices.begin(), contact.vertices.end(), stopped);
}

bool StepDetector::could_be_ended(const Contact& contact) const {
  if (std::any_of(contact.vertices.begin(), contact.vertices.end(),
                  [this](std::int32_t v) { return gives_way(v); }))
    return true;
  bool nodes_move = false, body_moves = false;
  for (const std::int32_t v : contact.vertices) {
    const Eigen::Vector3d end = found_any_ ? motion_.predicted[v] : motion_.end_of(v);
    if (end != motion_.start_of(v)) (topology_.is_soft(v) ? nodes_move : body_moves) = true;
  }
  return nodes_move && !body_moves;
}

bool StepDetector::gives_way(std::int32_t v) const {
  return topology_.is_soft(v) ? motion_.is_free(v) || motion_.carrier_of(v) >= 0
                              : motion_.rigid_of(topology_.body_of(v)).is_dynamic();
}

void StepDetector::find_silent() {
  if (!near_ || silent_is_known_) return;
  silent_.clear();
  for (const Contact& contact : near_->touching_again(motion_.starts(), motion_.ends())) {
    if (!is_anchored(contact) && !(responds(contact) && could_be_ended(contact)))
      silent_.push_back(contact);
  }
}

std::int64_t StepDetector::count_passed_over() const {
  return std::count_if(silent_.begin(), silent_.end(), [this](const Contact& contact) {
    const bool moves =
        std::any_of(contact.vertices.begin(), contact.vertices.end(),
                    [this](std::int32_t v) { return motion_.end_of(v) != motion_.start_of(v); });
    return moves && contact.toi > 0 && responds(contact);
  });
}

bool StepDetector::responds(const Contact& contact) const {
  return topology_.bodies()[contact.body_a].responds && topology_.bodies()[contact.body_b].responds;
}

bool StepDetector::are_anchored(std::int32_t body_a, std::int32_t body_b,
                                Span<const std::int32_t> vertices) const {
  const StepTopology::BodyRecord& a = topology_.bodies()[body_a];
  const StepTopology::BodyRecord& b = topology_.bodies()[body_b];
  if (a.soft && b.soft) return false;
  const btSoftBody& soft = a.soft ? *a.soft : *b.soft;
  const btCollisionObject* obstacle = a.soft ? b.object : a.object;
  const auto in_contact = [&](const btSoftBody::Node* node) {
    return std::any_of(vertices.begin(), vertices.end(), [&](std::int32_t v) {
      return topology_.is_soft(v) && &scene_.node(v) == node;
    });
  };
  for (int i = 0; i < soft.m_anchors.size(); ++i) {
    const btSoftBody::Anchor& anchor = soft.m_anchors[i];
    if (anchor.m_body == obstacle && in_contact(anchor.m_node)) return true;
  }
  for (int i = 0; i < soft.m_deformableAnchors.size(); ++i) {
    const btSoftBody::DeformableNodeRigidAnchor& anchor = soft.m_deformableAnchors[i];
    if (anchor.m_cti.m_colObj == obstacle && in_contact(anchor.m_node)) return true;
  }
  return false;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
