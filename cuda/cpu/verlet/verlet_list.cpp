#include "cpu/verlet/verlet_list.h"

#include <algorithm>
#include <cmath>

namespace lazyccd {

void ListedPairs::clear() {
  for (std::vector<ListedCandidate>& list : of) list.clear();
  pairs.clear();
}

void ListedPairs::add(ContactKind kind, Candidate candidate, float min_distance,
                      const RelativeMotionBounds& motion) {
  const bool vf = kind == ContactKind::vertex_face;
  std::uint32_t a = motion.leaf_of(vf ? kVertices : kEdges, candidate.a),
                b = motion.leaf_of(vf ? kFaces : kEdges, candidate.b);
  if (b < a) std::swap(a, b);
  std::uint32_t& latest = latest_[(31 * a + b) % latest_.size()];
  if (latest >= pairs.size() || pairs[latest].a != a || pairs[latest].b != b) {
    latest = static_cast<std::uint32_t>(pairs.size());
    pairs.push_back({a, b});
  }
  of[static_cast<int>(kind)].push_back({candidate, min_distance, latest});
}

std::size_t ListedPairs::bytes() const {
  return (of[0].capacity() + of[1].capacity()) * sizeof(ListedCandidate) +
         pairs.capacity() * sizeof(NodePair) + distance_limit.capacity() * sizeof(float);
}

void VerletList::set_tree(const Mesh& mesh, const Groups& groups, const Tree& tree,
                          ThreadPool& pool) {
  motion_.build(mesh, groups, tree, pool);
  forget();
}

bool VerletList::is_worthwhile(double scale) const {
  const double skin = skin_ * scale;
  return worthwhile_ && skin > 0x1p-400 && skin < 0x1p400;  // its square is a normal number
}

void VerletList::begin_step(const std::vector<VertexRecord>& records, double scale,
                            double tolerance, const Tree& tree, ThreadPool& pool) {
  if (!has_list_) motion_.begin(records, scale);
  motion_.measure(records, tree, pool);
  tolerance_ = 2 * tolerance * (1 + 0x1p-20) * motion_.scale();
  const double limit = 2 * skin_ * motion_.scale() - tolerance_;
  limit_squared_ = limit >= 0 ? limit * limit : -1;
}

void VerletList::begin_building(const std::vector<VertexRecord>& records, double scale) {
  motion_.begin(records, scale);
  for (ListedPairs& part : parts_) part.clear();
}

void VerletList::finish_building() {
  has_list_ = true;
  worthwhile_ = false;
  searched_ = 0;
  steps_ = 0;
}

std::size_t VerletList::size() const {
  std::size_t sum = 0;
  for (const ListedPairs& part : parts_) sum += part.size();
  return sum;
}

void VerletList::measure_distances() {
  for (ListedPairs& part : parts_) {
    part.distance_limit.resize(part.pairs.size());
    for (std::size_t i = 0; i < part.pairs.size(); ++i) {
      const double squared = motion_.difference_squared(part.pairs[i].a, part.pairs[i].b);
      part.distance_limit[i] =
          squared <= limit_squared_ ? distance_limit(std::sqrt(squared) + tolerance_) : -1;
    }
  }
}

// Returns the largest distance, when the list was built, of a candidate that can come within the
// separation after a relative motion of `relative_motion`. All values are scaled. Two points of two
// primitives move relative to each other by no more than their vertices do. The elementary test is
// conservative and may count distances slightly above the separation, so a margin is added.
float VerletList::distance_limit(double relative_motion) const {
  // Margins relative to the separation, and to the size of the scene (scaled:
  // core/narrow/elementary.h).
  constexpr double relative_margin = 0x1p-12, scene_margin = 0x1p-15;
  const double distance = separation_ * (1 + relative_margin) * motion_.scale() + relative_motion;
  return static_cast<float>(distance + scene_margin) * (1 + 0x1p-20f);
}

// Each step searches more than the one before, because more pairs of groups have moved too far. The
// list is discarded when a step searched more than half of the mean number per step since the list
// was built; the step that built it counts with the size of the list.
void VerletList::record_use(std::int64_t candidates) {
  ++steps_;
  searched_ += candidates;
  const std::int64_t since = static_cast<std::int64_t>(size()) + searched_;
  if (2 * candidates * (steps_ + 1) <= since) return;
  has_list_ = false;
  worthwhile_ = steps_ >= min_steps;
}

std::size_t VerletList::bytes() const {
  std::size_t sum = motion_.bytes() + parts_.capacity() * sizeof(ListedPairs);
  for (const ListedPairs& part : parts_) sum += part.bytes();
  return sum;
}

}  // namespace lazyccd
