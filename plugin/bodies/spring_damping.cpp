#include "bodies/spring_damping.h"

#include <algorithm>
#include <atomic>
#include <numeric>
#include <utility>

#include "bodies/ordered_sum.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

bool SpringDamping::read(const btDeformableMassSpringForce& force, const SpringConstants& constants,
                         int nodes, const ParallelFor& parallel_for) {
  constants_ = constants;
  ScratchVector<Body> bodies;
  std::size_t springs = 0;
  for (int i = 0; i < force.m_softBodies.size(); ++i) {
    const btSoftBody* const body = force.m_softBodies[i];
    if (!body->isActive()) continue;
    const auto count = static_cast<std::size_t>(body->m_links.size());
    bodies.push_back({body, springs, count});
    springs += count;
  }
  const bool is_planned =
      std::equal(bodies.begin(), bodies.end(), bodies_.begin(), bodies_.end()) &&
      first_end_.size() == static_cast<std::size_t>(nodes) + 1;
  if (is_planned && read_directions(parallel_for)) return true;
  return plan(bodies, nodes) && read_directions(parallel_for);
}

bool SpringDamping::plan(Span<const Body> bodies, int nodes) {
  bodies_.assign(bodies.begin(), bodies.end());
  springs_.clear();
  first_end_.assign(static_cast<std::size_t>(nodes) + 1, 0);
  for (const Body& b : bodies_) {
    for (int i = 0; i < b.body->m_links.size(); ++i) {
      const btSoftBody::Link& link = b.body->m_links[i];
      Spring spring{{link.m_n[0]->index, link.m_n[1]->index}, {}};
      for (const std::int32_t node : spring.node) {
        if (node < 0 || node >= nodes) {
          first_end_.clear();
          return false;
        }
        ++first_end_[static_cast<std::size_t>(node) + 1];
      }
      springs_.push_back(spring);
    }
  }
  std::partial_sum(first_end_.begin(), first_end_.end(), first_end_.begin());
  ends_.resize(first_end_.back());
  std::vector<std::size_t> next = first_end_;
  for (Spring& spring : springs_) {
    for (int end = 0; end < 2; ++end) {
      spring.place[end] = next[static_cast<std::size_t>(spring.node[end])]++;
      ends_[spring.place[end]].other = spring.node[1 - end];
    }
  }
  return true;
}

bool SpringDamping::read_directions(const ParallelFor& parallel_for) {
  std::atomic<bool> all_fit{true};
  for_ranges(parallel_for, springs_.size(), 4 * node_grain,
             [&](std::size_t first, std::size_t last) {
               bool fit = true;
               for (const Body& b : bodies_) {
                 const std::size_t end = std::min(last, b.first_spring + b.springs);
                 for (std::size_t i = std::max(first, b.first_spring); i < end; ++i) {
                   const int link = static_cast<int>(i - b.first_spring);
                   fit = read_direction(b.body->m_links[link], springs_[i]) && fit;
                 }
               }
               if (!fit) all_fit.store(false, std::memory_order_relaxed);
             });
  return all_fit;
}

bool SpringDamping::read_direction(const btSoftBody::Link& link, const Spring& spring) {
  const btSoftBody::Node &a = *link.m_n[0], &b = *link.m_n[1];
  if (a.index != spring.node[0] || b.index != spring.node[1]) return false;
  if (!constants_.along_spring) return true;
  const btVector3 difference = b.m_x - a.m_x;
  const btScalar length = difference.norm();
  if (!(length > SIMD_EPSILON)) return false;
  const btVector3 direction = difference / length;
  for (const std::size_t place : spring.place)
    for (int k = 0; k < 3; ++k) ends_[place].direction[k] = direction[k];
  return true;
}

void SpringDamping::subtract_diagonal(int node, btScalar scale, btVector3& diagonal) const {
  const btScalar factor = constants_.damping * scale;
  const auto row = static_cast<std::size_t>(node);
  for (std::size_t i = first_end_[row]; i < first_end_[row + 1]; ++i) {
    for (int k = 0; k < 3; ++k) {
      const btScalar d = constants_.along_spring ? ends_[i].direction[k] : btScalar(1);
      diagonal[k] -= constants_.along_spring ? factor * d * d : factor;
    }
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
