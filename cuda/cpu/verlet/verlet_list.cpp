#include "cpu/verlet/verlet_list.h"

#include <algorithm>
#include <cmath>

#include "lazyccd/debug/assert.h"

namespace lazyccd {

void ListedPairs::clear() {
  for (std::vector<ListedCandidate>& list : of) list.clear();
  pairs.clear();
}

void ListedPairs::add(ContactKind kind, Candidate candidate, float min_distance,
                      const VerletList& list) {
  const NodePair pair = list.leaves().owners_of(kind, candidate);
  std::uint32_t& latest = latest_[(31 * pair.a + pair.b) % latest_.size()];
  if (latest >= pairs.size() || pairs[latest].a != pair.a || pairs[latest].b != pair.b) {
    if (!list.would_list(pair)) return;
    latest = static_cast<std::uint32_t>(pairs.size());
    pairs.push_back(pair);
  }
  of[static_cast<int>(kind)].push_back({candidate, min_distance, latest});
}

std::size_t ListedPairs::bytes() const {
  return (of[0].capacity() + of[1].capacity()) * sizeof(ListedCandidate) +
         pairs.capacity() * sizeof(NodePair) + distance_limit.capacity() * sizeof(float);
}

void VerletList::set_tree(const Mesh& mesh, const Groups& groups, const Tree& tree,
                          ThreadPool& pool) {
  leaves_.build(mesh, groups, tree, pool);
  forget();
}

bool VerletList::is_worthwhile(double scale) const {
  const double skin = skin_ * scale;
  return worthwhile_ && skin > 0x1p-400 && skin < 0x1p400;  // its square is a normal number
}

void VerletList::begin_step(const std::vector<VertexRecord>& records, double tolerance,
                            const Tree& tree, ThreadPool& pool) {
  LAZYCCD_ASSERT(records.size() == origin_.size(), "a list is of the vertices of the step");
  motion_.measure(origin_, records, scale_, leaves_, tree, pool);
  tolerance_ = 2 * tolerance * (1 + 0x1p-20) * scale_;
  const double limit = 2 * skin_ * scale_ - tolerance_;
  limit_squared_ = limit >= 0 ? limit * limit : -1;
}

void VerletList::measure_step(const std::vector<VertexRecord>& last,
                              const std::vector<VertexRecord>& records, double scale,
                              const Tree& tree, ThreadPool& pool) {
  step_.measure_starts(last.size() == records.size() ? last : records, records, scale, leaves_,
                       tree, pool);
  const double limit = 2 * skin_ * scale / min_steps;
  step_limit_squared_ = limit * limit;
}

void VerletList::begin_building(const std::vector<VertexRecord>& records, double scale) {
  LAZYCCD_ASSERT(!has_list_, "a list is built where there is none");
  scale_ = scale;
  origin_.resize(records.size());
  for (std::size_t v = 0; v < records.size(); ++v) {
    const double* x = records[v].x;
    origin_[v] = {{x[0], x[1], x[2], x[0], x[1], x[2], 0, 0}};
  }
  built_step_ = step_;
  built_limit_squared_ = step_limit_squared_;
  for (ListedPairs& part : parts_) part.clear();
}

void VerletList::finish_building(std::int64_t visited, std::int64_t candidates) {
  has_list_ = true;
  worthwhile_ = false;
  cost_ = cost_of(visited, candidates);
  steps_ = 0;
}

std::size_t VerletList::size() const {
  std::size_t sum = 0;
  for (const ListedPairs& part : parts_) sum += part.size();
  return sum;
}

// Returns the largest distance, when the list was built, of a candidate that can come within the
// separation between bodies after a relative motion of `relative_motion`. All values are scaled.
// Two points of two primitives move relative to each other by no more than their vertices do. The
// elementary test is conservative and may count distances slightly above the separation, so a
// margin is added.
float VerletList::distance_limit(double relative_motion) const {
  // Margins relative to the separation, and to the size of the scene (scaled:
  // core/narrow/elementary.h).
  constexpr double relative_margin = 0x1p-12, scene_margin = 0x1p-15;
  const double distance = separation_ * (1 + relative_margin) * scale_ + relative_motion;
  return static_cast<float>(distance + scene_margin) * (1 + 0x1p-20f);
}

// Steps tend to cost more and more, because more pairs have moved too far. The list is discarded
// once a step costs more than the mean, with the step that built it. If that mean is less than the
// last step without a list cost, the next step builds again. Otherwise there is a pause.
void VerletList::record_use(std::int64_t visited, std::int64_t candidates) {
  const std::int64_t cost =
      cost_of(visited, candidates) + static_cast<std::int64_t>(size()) / listed_per_candidate;
  ++steps_;
  cost_ += cost;
  if (cost * (steps_ + 1) <= cost_) return;
  has_list_ = false;
  worthwhile_ = cost_ < cost_without_ * (steps_ + 1);
  steps_to_wait_ = worthwhile_ ? 0 : pause_;
  pause_ = worthwhile_ ? 1 : std::min(2 * pause_, max_pause);
}

void VerletList::record_probe(std::int64_t visited, std::int64_t candidates, bool may_serve) {
  cost_without_ = cost_of(visited, candidates);
  steps_to_wait_ = std::max(0, steps_to_wait_ - 1);
  worthwhile_ = may_serve && steps_to_wait_ == 0;
}

std::size_t VerletList::bytes() const {
  std::size_t sum = leaves_.bytes() + origin_.capacity() * sizeof(VertexRecord) +
                    parts_.capacity() * sizeof(ListedPairs);
  for (const RelativeMotionBounds* bounds : {&motion_, &step_, &built_step_})
    sum += bounds->bytes();
  for (const ListedPairs& part : parts_) sum += part.bytes();
  return sum;
}

}  // namespace lazyccd
