#include "detection/step_detector.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "contact/contact_checks.h"
#include "lazyccd/debug/assert.h"
#include "lazyccd/debug/stopwatch.h"
#include "scene/collision_filters.h"
#include "settings.h"
#include "util/profile.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

std::vector<BodyPair> sorted_pairs(std::vector<BodyPair> pairs) {
  for (BodyPair& pair : pairs) std::sort(pair.begin(), pair.end());
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

}  // namespace

StepDetector::StepDetector(const DetectorOptions& options, const Threads& threads,
                           ContactFilter& filter, const StepTopology& topology, Motion& motion,
                           PairSurfaces& surfaces, double position_correction, bool contact_cache)
    : options_(options),
      threads_(threads),
      filter_(filter),
      topology_(topology),
      motion_(motion),
      surfaces_(surfaces),
      selector_(surfaces, position_correction,
                [this](std::int32_t a, std::int32_t b) { return stop_each_other(a, b); }),
      simple_contacts_(topology, motion, surfaces, filter),
      internal_edges_(topology, motion, surfaces),
      may_keep_near_(contact_cache) {
  options_.separation = 0;
  options_.reduce_contacts = false;
}

void StepDetector::set_lengths(double largest_thickness, const Renumbering& numbers,
                               const std::vector<std::int32_t>& changed_bodies) {
  prediction_.forget();
  measure_edges(topology_.for_detection(), numbers, marks_of(changed_bodies));
  const double separation = separation_for(largest_thickness);
  if (separation_ != separation) {
    near_detector_.reset();
    cache_.forget();
  }
  separation_ = separation;
  surfaces_.limit_thickness(thickness_limits());
}

void StepDetector::set_topology(const Renumbering& numbers,
                                const std::vector<std::int32_t>& changed_bodies) {
  note_seen_end();
  touching_topology_is_current_ = false;
  if (!(separation_ > 0)) {
    near_detector_.reset();
    forget_near();
    simple_contacts_.clear();
    others_may_meet_ = true;
    primitives_ = {};
    filters_.clear();
    rules_.clear();
    disabled_pairs_.clear();
    touching_detector();
    return;
  }
  std::vector<char> is_changed = marks_of(changed_bodies);
  std::vector<std::int32_t> new_index = numbers.bodies;
  for (std::int32_t& body : new_index)
    if (body >= 0 && is_changed[static_cast<std::size_t>(body)]) body = -1;
  simple_contacts_.set_topology(new_index);
  if (!near_detector_) {
    DetectorOptions options = options_;
    options.separation = separation_;
    options.reduce_contacts = true;
    near_detector_ = std::make_unique<Detector>(options, threads_);
  }
  const PrimitiveIndices last = std::move(primitives_);
  const std::vector<Body> last_filters = std::move(filters_);
  const std::vector<BodyPair> last_disabled = std::move(disabled_pairs_);
  set_near_topology();
  mark_other_rules(numbers, last_filters, last_disabled, is_changed);
  const ContactRenumbering kept(last, primitives_, numbers, is_changed);
  cache_.renumber(kept, motion_.start().size());
  selector_.renumber(kept);
}

std::vector<char> StepDetector::marks_of(const std::vector<std::int32_t>& bodies) const {
  std::vector<char> marks(topology_.bodies().size(), 0);
  for (const std::int32_t body : bodies) marks[static_cast<std::size_t>(body)] = 1;
  return marks;
}

void StepDetector::set_near_topology() {
  Topology topology = topology_.for_detection();
  topology.self_separation = self_separation_;
  rules_.assign(topology.bodies.begin(), topology.bodies.end());
  filters_ = rules_;
  simple_contacts_.leave_out(filters_);
  topology.bodies = filters_;
  disabled_pairs_ = sorted_pairs({topology.disabled_pairs.begin(), topology.disabled_pairs.end()});
  others_may_meet_ = find_others_may_meet(topology.bodies);
  near_detector_->set_topology(topology);
  find_self_distances(topology.bodies);
  internal_edges_.set_topology(near_detector_->edges(), topology.bodies, largest_thickness());
  if (!internal_edges_.edges_left_out().empty())
    near_detector_->leave_out(internal_edges_.edges_left_out(),
                              internal_edges_.vertices_left_out());
  primitives_ = PrimitiveIndices(topology_, near_detector_->edges());
}

void StepDetector::mark_other_rules(const Renumbering& numbers,
                                    const std::vector<Body>& last_filters,
                                    const std::vector<BodyPair>& last_disabled,
                                    std::vector<char>& is_changed) const {
  // The new number of a body, or -1 if it is gone. A step that failed may have taken new numbers
  // and left the rules as they were.
  const auto number_of = [&](std::size_t old) {
    const std::int32_t body = old < numbers.bodies.size() ? numbers.bodies[old] : -1;
    return static_cast<std::size_t>(body) < is_changed.size() ? body : -1;
  };
  std::vector<BodyPair> disabled;  // before, by new number
  for (const auto [a, b] : last_disabled)
    disabled.push_back(
        {number_of(static_cast<std::size_t>(a)), number_of(static_cast<std::size_t>(b))});
  std::vector<char> is_old(is_changed.size(), 0);
  for (std::size_t old = 0; old < last_filters.size(); ++old) {
    const std::int32_t body = number_of(old);
    if (body < 0) continue;
    is_old[static_cast<std::size_t>(body)] = 1;
    if (!are_equal_filters(last_filters[old], filters_[static_cast<std::size_t>(body)]))
      is_changed[static_cast<std::size_t>(body)] = 1;
  }
  disabled = sorted_pairs(std::move(disabled));
  const auto mark_if_not_in = [&](const BodyPair& pair, const std::vector<BodyPair>& list) {
    if (std::binary_search(list.begin(), list.end(), pair)) return;
    for (const std::int32_t body : pair) is_changed[static_cast<std::size_t>(body)] = 1;
  };
  const auto both_are_old = [&is_old](const BodyPair& pair) {
    return pair[0] >= 0 && pair[1] >= 0 && is_old[static_cast<std::size_t>(pair[0])] &&
           is_old[static_cast<std::size_t>(pair[1])];
  };
  for (const BodyPair& pair : disabled)
    if (both_are_old(pair)) mark_if_not_in(pair, disabled_pairs_);
  for (const BodyPair& pair : disabled_pairs_)
    if (both_are_old(pair)) mark_if_not_in(pair, disabled);
}

bool StepDetector::stop_each_other(std::int32_t a, std::int32_t b) const {
  const auto is_rigid = [this](std::int32_t body) { return motion_.rigid_of_body()[body] >= 0; };
  if (a == b) return true;
  return !(is_rigid(a) && is_rigid(b)) && filters_accept(rules_[a], rules_[b]) &&
         !std::binary_search(disabled_pairs_.begin(), disabled_pairs_.end(),
                             BodyPair{std::min(a, b), std::max(a, b)});
}

bool StepDetector::find_others_may_meet(Span<const Body> filters) const {
  for (std::size_t a = 0; a < filters.size(); ++a) {
    if (filters[a].self_collision) return true;
    for (std::size_t b = a + 1; b < filters.size(); ++b)
      if (filters_accept(filters[a], filters[b])) return true;
  }
  return false;
}

double StepDetector::separation_for(double largest_thickness) const {
  return std::min(settings::detection::distance_factor * largest_thickness,
                  settings::detection::max_median_edges * common_median_edge_);
}

std::vector<double> StepDetector::thickness_limits() const {
  std::vector<double> limits(topology_.bodies().size(), std::numeric_limits<double>::infinity());
  const std::vector<double>& median_edge = motion_.median_edge();
  for (std::size_t body = 0; separation_ > 0 && body < median_edge.size(); ++body)
    limits[body] =
        std::min(largest_thickness(), settings::detection::max_median_edges * median_edge[body] /
                                          settings::detection::distance_factor);
  return limits;
}

void StepDetector::measure_edges(const Topology& topology, const Renumbering& numbers,
                                 const std::vector<char>& is_changed) {
  std::vector<double>& shortest_edge = motion_.input().shortest_edge;
  const std::vector<double> last = std::move(shortest_edge);
  shortest_edge.assign(motion_.inverse_mass().size(), std::numeric_limits<double>::infinity());
  const auto read_edge = [&](std::int32_t a, std::int32_t b) {
    if (!topology_.is_soft(a)) return;
    const double length = (motion_.start_of(a) - motion_.start_of(b)).norm();
    for (const std::int32_t v : {a, b}) shortest_edge[v] = std::min(shortest_edge[v], length);
  };
  for (const Edge& edge : topology.edges) read_edge(edge[0], edge[1]);
  for (const Face& face : topology.faces) {
    for (int k = 0; k < 3; ++k) read_edge(face[k], face[(k + 1) % 3]);
  }
  for (std::size_t old = 0; old < std::min(last.size(), numbers.vertices.size()); ++old) {
    const std::int32_t v = numbers.vertices[old];
    if (v >= 0 && topology_.is_soft(v) &&
        !is_changed[static_cast<std::size_t>(topology.body_of_vertex[v])])
      shortest_edge[v] = last[old];
  }
  std::vector<double> lengths = shortest_edge;
  const auto common = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), common, lengths.end());
  common_median_edge_ = *common;
  lengths = shortest_edge;
  motion_.input().median_edge.clear();
  for (const StepTopology::BodyRecord& body : topology_.bodies()) {
    if (!body.soft) continue;
    const auto first = lengths.begin() + body.first_vertex, middle = first + body.vertex_count / 2;
    std::nth_element(first, middle, first + body.vertex_count);
    motion_.input().median_edge.push_back(*middle);
  }
  self_separation_.assign(topology.vertex_count, std::numeric_limits<float>::infinity());
  for (std::int32_t v = 0; v < motion_.soft_count(); ++v)
    self_separation_[v] = NearContactSelector::self_separation(v, motion_);
}

Detector& StepDetector::touching_detector() {
  if (!touching_detector_) touching_detector_ = std::make_unique<Detector>(options_, threads_);
  if (!touching_topology_is_current_) touching_detector_->set_topology(topology_.for_detection());
  touching_topology_is_current_ = true;
  return *touching_detector_;
}

void StepDetector::detect_ahead() {
  if (near_detector_ && !rest_changed_) prediction_.start_ahead(*near_detector_, separation_);
}

void StepDetector::end_step(bool responded) {
  LAZYCCD_ASSERT(seen_end_ == motion_.end,
                 "the end of the step is the one that the last detection saw");
  // Where some steps need no detection, the next one would probably be started in vain.
  if (near_detector_ && detected_near_ && detected_near_last_)
    prediction_.remember(motion_, responded);
  detected_near_last_ = detected_near_;
}

void StepDetector::begin_motion() {
  report_only_contacts_.clear();
  report_only_is_known_ = true;
  found_any_ = false;
  filter_.begin_motion();
  counts_ = {};
  detected_near_ = keeps_near_ = keeps_some_ = false;
}

std::vector<Contact> StepDetector::touching(const Positions& start, const Positions& end) {
  LAZYCCD_BT_PROFILE("re-check");
  Stopwatch watch;
  const Span<const Contact> found = !others_may_meet_ || keeps_near_ || only_near_can_touch(end)
                                        ? recheck(start, end)
                                        : touching_detector().detect(start, end);
  if (near_detector_ || counts_.detections == 0) record_report_only(found);
  ++counts_.detections;
  std::vector<Contact> contacts = keep_acting(found);
  report_only_is_known_ = contacts.empty() && is_end_of_motion(end);
  if (is_end_of_motion(end)) note_seen_end();
  counts_.ms_detect += watch.lap();
  return contacts;
}

Span<const Contact> StepDetector::recheck(const Positions& start, const Positions& end) {
  const bool at_start = is_start_of_motion(end);
  if (!simple_contacts_.are_clear(at_start)) return touching_detector().detect(start, end);
  if (!others_may_meet_) return {};
  const bool kept_may_touch =
      keeps_some_ && (leaves_out_any() || !cache_.keeps_apart(motion_, at_start));
  if (keeps_near_ && !kept_may_touch) return {};
  // A GPU finds what touches sooner than the CPU tests near pairs again.
  const bool is_on_gpu = near_detector_->stats().backend == "cuda";
  if (kept_may_touch || leaves_out_any() || is_on_gpu)
    return touching_detector().detect(start, end);
  const Span<const Contact> found = near_detector_->recheck_near_pairs(start, end);
  ++counts_.rechecks;
  counts_.searches_again += near_detector_->stats().searched_again;
  return found;
}

// A pair that the first detection did not report stayed further apart than its separation at all
// times. So it cannot touch as long as the deviations of any two vertices that may collide add up
// to less than that. A pair farther apart than its separation at the start cannot touch there.
bool StepDetector::only_near_can_touch(const Positions& end) const {
  return near_detector_ &&
         (near_detector_->can_recheck_any_motion() || is_start_of_motion(end) ||
          motion_.deviates_less_than(topology_.topology().bodies, separation_, self_distances_));
}

NearContacts StepDetector::detect_near(LastImpulses& last_impulses) {
  LAZYCCD_BT_PROFILE("detect");
  if (!near_detector_) {
    touching_pairs_ = touching(motion_.starts(), motion_.ends());
    last_impulses.match(touching_pairs_);
    found_any_ = !touching_pairs_.empty();
    return selector_.evaluate_all(touching_pairs_, motion_);
  }
  Stopwatch watch;
  Span<const Contact> near;
  bool any_near = false;
  ++counts_.detections;
  if (!simple_contacts_.find_near(separation_, near_simple_)) {
    prediction_.forget();
    cache_.forget();
    set_near_topology();
  }
  if (others_may_meet_) {
    near = find_near_with_detector();
    any_near = any_near_;
  }
  if (!near_simple_.empty()) {
    near_.resize(near.size() + near_simple_.size());
    std::merge(near.begin(), near.end(), near_simple_.begin(), near_simple_.end(), near_.begin());
    near = near_;
    any_near = true;
  }
  LAZYCCD_ASSERT(are_sorted(near), "near contacts of all sources are sorted, none twice");
  LAZYCCD_ASSERT(are_of(near, motion_), "near contacts are of bodies and vertices of the motion");
  counts_.near_pairs += static_cast<std::int64_t>(near.size());
  if (last_impulses.needs_match()) {
    last_impulses.match(near);
    selector_.remember(last_impulses.pairs());
  }
  const NearContacts selected = selector_.select(near, filter_, motion_, threads_);
  found_any_ = selector_.any_responds();
  if (!found_any_ && (any_near || !simple_contacts_.are_clear(false))) {
    // Contact reduction reports one pair for several. Even if the response does not act on the
    // reported pair, it may act on an omitted one: the reported pair may lack a vertex that the
    // other has, or contain an anchored one. So all near pairs are tested again.
    const Span<const Contact> found = recheck(motion_.starts(), motion_.ends());
    record_report_only(found);
    ++counts_.detections;
    found_any_ = !keep_acting(found).empty();
  }
  report_only_is_known_ = !found_any_;
  note_seen_end();
  counts_.ms_detect += watch.lap();
  return selected;
}

Span<const Contact> StepDetector::find_near_with_detector() {
  keeps_near_ = keeps_some_ = may_keep_near_ && cache_.begin(motion_, found_distances());
  if (keeps_near_) {
    ++counts_.cached_detections;
    prediction_.forget();
    return cache_.contacts();
  }
  if (may_keep_near_) {
    const Span<const char> stays = cache_.stays();
    keeps_some_ = std::find(stays.begin(), stays.end(), 1) != stays.end();
    rest_changed_ = near_detector_->set_resting(stays);
  }
  near_detector_->detect(motion_.starts(), motion_.ends());
  constrained_ = near_detector_->take_contacts(std::move(constrained_));
  detected_near_ = true;
  const Stats& stats = near_detector_->stats();
  counts_.started_ahead += stats.started_ahead;
  counts_.candidates += stats.candidates_vf + stats.candidates_ee;
  counts_.listed_candidates += stats.listed_candidates;
  prediction_.compare(motion_, stats.candidates_vf + stats.candidates_ee);
  any_near_ = stats.near_pairs > 0 || leaves_out_any() || (any_near_ && keeps_some_);
  internal_edges_.remove(constrained_);
  if (!may_keep_near_) return constrained_;
  cache_.take(std::move(constrained_), near_detector_->near_distances());
  return cache_.contacts();
}

void StepDetector::find_self_distances(Span<const Body> filters) {
  self_distances_.assign(filters.size(), separation_);
  for (std::size_t b = 0; b < filters.size(); ++b) {
    const StepTopology::BodyRecord& body = topology_.bodies()[b];
    if (!body.soft || !filters[b].self_collision) continue;
    for (std::int32_t v = body.first_vertex; v < body.first_vertex + body.vertex_count; ++v)
      self_distances_[b] = std::min<double>(self_distances_[b], self_separation_[v]);
  }
}

// All pairs within their separation are found. But what counts is the thickness of the pair, which
// may be much smaller.
Span<const double> StepDetector::found_distances() {
  found_distances_.resize(self_distances_.size());
  for (std::size_t b = 0; b < found_distances_.size(); ++b) {
    const double thickness = surfaces_.least_thickness_of(static_cast<std::int32_t>(b));
    found_distances_[b] =
        std::min(self_distances_[b], settings::detection::distance_factor * thickness);
  }
  return found_distances_;
}

std::vector<Contact> StepDetector::keep_acting(Span<const Contact> contacts) const {
  std::vector<Contact> result;
  for (const Contact& contact : contacts) {
    const ContactFilter::Verdict verdict = filter_.verdict(contact);
    if (verdict == ContactFilter::Verdict::act || verdict == ContactFilter::Verdict::rest)
      result.push_back(contact);
  }
  return result;
}

void StepDetector::record_report_only(Span<const Contact> contacts) {
  report_only_contacts_.clear();
  for (const Contact& contact : contacts) {
    if (filter_.verdict(contact) == ContactFilter::Verdict::report_only)
      report_only_contacts_.push_back(contact);
  }
}

void StepDetector::find_report_only_contacts() {
  if (!near_detector_ || report_only_is_known_) return;
  record_report_only(recheck(motion_.starts(), motion_.ends()));
}

std::int64_t StepDetector::count_passed_over() const {
  return std::count_if(
      report_only_contacts_.begin(), report_only_contacts_.end(), [this](const Contact& contact) {
        const bool moves = std::any_of(
            contact.vertices.begin(), contact.vertices.end(),
            [this](std::int32_t v) { return motion_.end_of(v) != motion_.start_of(v); });
        return moves && contact.toi > 0 && filter_.bodies_respond(contact);
      });
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
