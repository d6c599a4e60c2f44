#include "cpu/verlet/verlet_list.h"

#include <algorithm>
#include <cmath>

namespace lazyccd {

void ListedPairs::clear() {
  for (std::vector<ListedCandidate>& list : of) list.clear();
  pairs.clear();
}

void ListedPairs::add(ContactKind kind, Candidate candidate, float apart,
                     const RelativeMotionBounds& groups) {
  const bool vf = kind == ContactKind::vertex_face;
  std::uint32_t a = groups.leaf_of(vf ? kVertices : kEdges, candidate.a),
                b = groups.leaf_of(vf ? kFaces : kEdges, candidate.b);
  if (b < a) std::swap(a, b);
  std::uint32_t& latest = latest_[(31 * a + b) % latest_.size()];
  if (latest >= pairs.size() || pairs[latest].a != a || pairs[latest].b != b) {
    latest = static_cast<std::uint32_t>(pairs.size());
    pairs.push_back({a, b});
  }
  of[static_cast<int>(kind)].push_back({candidate, apart, latest});
}

std::size_t ListedPairs::bytes() const {
  return (of[0].capacity() + of[1].capacity()) * sizeof(ListedCandidate) +
         pairs.capacity() * sizeof(NodePair) + distance_limit.capacity() * sizeof(float);
}

void VerletList::build(const Mesh& mesh, const Groups& groups, const Tree& tree) {
  groups_.build(mesh, groups, tree);
  forget();
}

bool VerletList::is_worthwhile(double scale) const {
  const double skin = skin_ * scale;
  return worthwhile_ && skin > 0x1p-400 && skin < 0x1p400;  // its square is a normal number
}

void VerletList::begin_step(const std::vector<VertexRecord>& records, double scale, double tolerance,
                          const Tree& tree, ThreadPool& pool) {
  if (!made_) groups_.begin(records, scale);
  groups_.measure(records, tree, pool);
  unknown_ = 2 * tolerance * (1 + 0x1p-20) * groups_.scale();
  const double limit = 2 * skin_ * groups_.scale() - unknown_;
  limit_squared_ = limit >= 0 ? limit * limit : -1;
}

void VerletList::begin(const std::vector<VertexRecord>& records, double scale) {
  groups_.begin(records, scale);
  for (ListedPairs& part : parts_) part.clear();
}

void VerletList::complete() {
  made_ = true;
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
      const double squared = groups_.difference_squared(part.pairs[i].a, part.pairs[i].b);
      part.distance_limit[i] = squared <= limit_squared_ ? reach(std::sqrt(squared) + unknown_) : -1;
    }
  }
}

// Points of two primitives move no more differently than their vertices. What stays so little above
// the separation that the test, which is conservative, may count it as near is tested.
float VerletList::reach(double difference) const {
  constexpr double of_separation = 0x1p-12,
                   of_scene = 0x1p-15;  // the latter scaled: core/elementary.h
  const double apart = separation_ * (1 + of_separation) * groups_.scale() + difference;
  return static_cast<float>(apart + of_scene) * (1 + 0x1p-20f);
}

// Each step seeks more than the one before. Another list is made once a step sought more than half
// of the mean since this one was made, that included.
void VerletList::record_use(std::int64_t candidates) {
  ++steps_;
  searched_ += candidates;
  const std::int64_t since = static_cast<std::int64_t>(size()) + searched_;
  if (2 * candidates * (steps_ + 1) <= since) return;
  made_ = false;
  worthwhile_ = steps_ >= least_steps;
}

std::size_t VerletList::bytes() const {
  std::size_t sum = groups_.bytes() + parts_.capacity() * sizeof(ListedPairs);
  for (const ListedPairs& part : parts_) sum += part.bytes();
  return sum;
}

}  // namespace lazyccd
